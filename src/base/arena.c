#include "base/arena.h"

#include <stdint.h>
#include <stdlib.h>

#define ALIGN 64
typedef struct ArenaOld {
    struct ArenaOld *next;
    char *block;
} ArenaOld;

// A block of `size` for what comes next; the present one is kept until the reset.
static bool new_block(Arena *arena, size_t size)
{
    char *block = aligned_alloc(ALIGN, size);
    ArenaOld *old = arena->block ? malloc(sizeof *old) : NULL;
    if (!block || (arena->block && !old)) {
        free(block);
        free(old);
        return false;
    }
    if (old) *old = (ArenaOld){arena->old, arena->block};
    if (old) arena->old = old;
    arena->block = block;
    arena->size = size;
    arena->used = 0;
    return true;
}

void *fs_arena_alloc(Arena *arena, size_t size)
{
    if (size > SIZE_MAX / 4) arena->failed = true;
    if (arena->failed) return NULL;
    size = (size + ALIGN - 1) / ALIGN * ALIGN;
    arena->total += size;
    if (arena->used + size > arena->size) {
        size_t wanted = arena->size * 2 > size ? arena->size * 2 : size;
        if (wanted < 1 << 16) wanted = 1 << 16;
        arena->failed = !new_block(arena, wanted) && !new_block(arena, size);
        if (arena->failed) return NULL;
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
        size_t size = (arena->total + arena->total / 4 + ALIGN - 1) / ALIGN * ALIGN;
        arena->block = aligned_alloc(ALIGN, size);
        arena->size = arena->block ? size : 0; // else the next one to ask tries again
    }
    arena->used = arena->total = 0;
    arena->failed = false;
}

void fs_arena_free(Arena *arena)
{
    free_old(arena);
    free(arena->block);
    *arena = (Arena){0};
}
