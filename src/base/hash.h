// 64-bit hashes that tell whether bytes changed. Chance will not make two the same; someone who wants to, can.
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FS_HASH_EMPTY 0x9e3779b97f4a7c15u // of nothing

uint64_t fs_hash_bytes(uint64_t hash, const void *data, size_t size); // goes on from hash
uint64_t fs_hash_text(uint64_t hash, const char *text);               // with its end: "ab", "c" is not "a", "bc"
// The content of a regular file, goes on from *hash. -1: cannot be read. follow: as a link says, else links are none.
int fs_hash_file(const char *path, bool follow, uint64_t *hash, uint64_t *size);
