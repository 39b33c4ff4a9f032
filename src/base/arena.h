// Bump allocator for the scratch memory of one step: grows in the first steps, then never calls malloc.
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef struct Arena {
    char *block;          // current block, 64-byte aligned
    size_t size, used;    // of the current block
    size_t total;         // asked for since the last reset, over all blocks
    struct ArenaOld *old; // blocks outgrown since the last reset
    bool failed;          // out of memory since the last reset: some pointer handed out is NULL
} Arena;

// 64-byte aligned, not cleared; NULL when out of memory, and from then on until the reset: who allocates many things
// may look at `failed` once, before using any.
void *fs_arena_alloc(Arena *arena, size_t size);
void fs_arena_reset(Arena *arena); // everything handed out is void; merges into one block that held it all
void fs_arena_free(Arena *arena);

#define ARENA_NEW(arena, type, n) ((type *)fs_arena_alloc((arena), sizeof(type) * (size_t)(n)))
