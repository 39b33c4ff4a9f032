#ifndef FS_EXP_H
#define FS_EXP_H
#include <stdlib.h>
static inline double fs_exp(const char *name, double def){const char*s=getenv(name);return s?atof(s):def;}
#endif
