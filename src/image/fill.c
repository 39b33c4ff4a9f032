#include "image/fill.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/bilinear.h"

enum { LEVELS_MAX = 20 };

typedef struct Level {
    int width, height;
    float *value, *weight; // averages and 0..1
} Level;

static void push(const Level *fine, Level *coarse, int channels)
{
    for (int y = 0; y < fine->height; y++)
        for (int x = 0; x < fine->width; x++) {
            size_t from = (size_t)y * (size_t)fine->width + (size_t)x;
            size_t to = (size_t)(y / 2) * (size_t)coarse->width + (size_t)(x / 2);
            coarse->weight[to] += fine->weight[from];
            for (int c = 0; c < channels; c++)
                coarse->value[to * (size_t)channels + (size_t)c] +=
                    fine->weight[from] * fine->value[from * (size_t)channels + (size_t)c];
        }
    for (size_t i = 0; i < (size_t)coarse->width * (size_t)coarse->height; i++) {
        for (int c = 0; c < channels && coarse->weight[i] > 0; c++)
            coarse->value[i * (size_t)channels + (size_t)c] /= coarse->weight[i];
        coarse->weight[i] = fminf(coarse->weight[i], 1);
    }
}

static void pull(const Level *coarse, Level *fine, int channels)
{
    for (int y = 0; y < fine->height; y++)
        for (int x = 0; x < fine->width; x++) {
            size_t at = (size_t)y * (size_t)fine->width + (size_t)x;
            float w = fine->weight[at];
            if (w >= 1) continue;
            float u = fmaxf(((float)x - 0.5f) / 2, 0), v = fmaxf(((float)y - 0.5f) / 2, 0);
            Bilinear place = fs_bilinear_at((double)u, (double)v, coarse->width, coarse->height);
            for (int c = 0; c < channels; c++) {
                float *out = &fine->value[at * (size_t)channels + (size_t)c];
                *out = w * *out + (1 - w) * fs_bilinear_value(&place, coarse->value, channels, c);
            }
        }
}

// The next level's size.
static int half(int side)
{
    return (side + 1) / 2;
}

size_t fs_fill_room(int width, int height, int channels)
{
    size_t floats = (size_t)width * (size_t)height; // weights of the finest level; the others have values, too
    while (width > 1 || height > 1) {
        width = half(width);
        height = half(height);
        floats += (size_t)width * (size_t)height * ((size_t)channels + 1);
    }
    return floats;
}

bool fs_fill_holes_in(float *room, float *value, const float *weight, int width, int height, int channels)
{
    Level level[LEVELS_MAX] = {{width, height, value, room}};
    size_t n = (size_t)width * (size_t)height;
    int levels = 1;
    bool any = false;
    for (size_t i = 0; i < n; i++) {
        room[i] = fminf(weight[i], 1);
        any |= weight[i] > 0;
        for (int c = 0; c < channels && weight[i] > 0; c++) value[i * (size_t)channels + (size_t)c] /= weight[i];
    }
    room += n;
    while (levels < LEVELS_MAX && (level[levels - 1].width > 1 || level[levels - 1].height > 1)) {
        Level *fine = &level[levels - 1], *coarse = &level[levels++];
        coarse->width = half(fine->width);
        coarse->height = half(fine->height);
        n = (size_t)coarse->width * (size_t)coarse->height;
        coarse->value = room;
        coarse->weight = room + n * (size_t)channels;
        memset(room, 0, sizeof *room * n * ((size_t)channels + 1));
        room += n * ((size_t)channels + 1);
        push(fine, coarse, channels);
    }
    for (int l = levels - 2; l >= 0; l--) pull(&level[l + 1], &level[l], channels);
    return any;
}

int fs_fill_holes(float *value, const float *weight, int width, int height, int channels, bool *any, FsError *err)
{
    float *room = malloc(sizeof *room * fs_fill_room(width, height, channels));
    if (!room) return fs_error_memory(err);
    *any = fs_fill_holes_in(room, value, weight, width, height, channels);
    free(room);
    return 0;
}
