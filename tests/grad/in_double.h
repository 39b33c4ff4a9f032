// Turns the scalar kernels into double precision for finite differences: include the system headers first, then this,
// then the kernels' .c files.
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/rng.h"

#define float double
#define powf pow
#define expf exp
#define logf log
#define sqrtf sqrt
#define fabsf fabs
#define fmaxf fmax
#define fminf fmin
#define floorf floor
#define _Static_assert(...) // sizes differ
