#include "image/number.h"

#include <stdint.h>

#include "image/half.h"

double fs_number_read(const char *at, char kind, int size, bool swapped)
{
    union {
        char byte[8];
        int8_t i8;
        uint8_t u8;
        int16_t i16;
        uint16_t u16;
        int32_t i32;
        uint32_t u32;
        float f32;
        double f64;
    } v;
    for (int i = 0; i < size; i++) v.byte[i] = at[swapped ? size - 1 - i : i];
    if (kind == 'i') return size == 1 ? v.i8 : size == 2 ? v.i16 : v.i32;
    if (kind == 'u') return size == 1 ? v.u8 : size == 2 ? v.u16 : v.u32;
    return size == 2 ? (double)half_to_float(v.u16) : size == 4 ? (double)v.f32 : v.f64;
}
