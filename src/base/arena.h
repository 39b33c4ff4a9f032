// Bump allocator for the scratch memory of one step: grows in the first steps, then never calls malloc.
#ifndef FS_BASE_ARENA_H
#define FS_BASE_ARENA_H

#include <stddef.h>

typedef struct Arena {
    char *block;          // current block, 64-byte aligned
    size_t size, used;    // of the current block
    size_t total;         // asked for since the last reset, over all blocks
    struct ArenaOld *old; // blocks outgrown since the last reset
} Arena;

// 64-byte aligned, not cleared. Aborts the process only when the system is out of memory.
void *fs_arena_alloc(Arena *arena, size_t size);
void fs_arena_reset(Arena *arena); // everything handed out is void; merges into one block that held it all
void fs_arena_free(Arena *arena);

#define ARENA_NEW(arena, type, n) ((type *)fs_arena_alloc((arena), sizeof(type) * (size_t)(n)))

#endif
