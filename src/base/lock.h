// One program at a time: a lock on a file, which goes with the program however it ends.
#pragma once

#include <stdbool.h>

typedef struct Lock {
    bool held;
    int fd; // where it is held
} Lock;

// False: another program has it, or another Lock of this one. True, and not held, where the disk knows no locks, or the
// file can neither be made nor read.
bool fs_lock_take(Lock *lock, const char *path);
void fs_lock_release(Lock *lock);
