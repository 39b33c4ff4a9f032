#include "base/arena.h"

#include <stdlib.h>

#define ALIGN 64
typedef struct ArenaOld {
    struct ArenaOld *next;
    char *block;
} ArenaOld;

static void *must(void *p)
{
    if (!p) abort();
    return p;
}

void *fs_arena_alloc(Arena *arena, size_t size)
{
    size = (size + ALIGN - 1) / ALIGN * ALIGN;
    arena->total += size;
    if (arena->used + size > arena->size) {
        if (arena->block) {
            ArenaOld *old = must(malloc(sizeof *old));
            *old = (ArenaOld){arena->old, arena->block};
            arena->old = old;
        }
        arena->size = arena->size * 2 > size ? arena->size * 2 : size;
        if (arena->size < 1 << 16) arena->size = 1 << 16;
        arena->block = must(aligned_alloc(ALIGN, arena->size));
        arena->used = 0;
    }
    void *p = arena->block + arena->used;
    arena->used += size;
    return p;
}

static void free_old(Arena *arena)
{
    while (arena->old) {
        ArenaOld *next = arena->old->next;
        free(arena->old->block);
        free(arena->old);
        arena->old = next;
    }
}

void fs_arena_reset(Arena *arena)
{
    if (arena->old) {
        free_old(arena);
        free(arena->block);
        arena->size = (arena->total + arena->total / 4 + ALIGN - 1) / ALIGN * ALIGN;
        arena->block = must(aligned_alloc(ALIGN, arena->size));
    }
    arena->used = arena->total = 0;
}

void fs_arena_free(Arena *arena)
{
    free_old(arena);
    free(arena->block);
    *arena = (Arena){0};
}
