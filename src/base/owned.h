// What is ours on disk. A folder that this program writes into holds .flashsplat/made: a first line that says what the
// folder is, then a line for every file before it gets its name (hash and size of its content, its name below the
// folder) and for every folder that was made. A file is ours while its content is that of such a line: it can be made
// again, so it may be removed and overwritten. All else is the user's, whatever its name, and stays as it is. Contents,
// not times: copies of a folder and archives keep them, and an edited file is the user's. A line that lies, because a
// crash kept the file from its name, harms nobody. What lies in .flashsplat itself (files being written, COLMAP's work)
// is ours by its place. A file elsewhere (--json FILE) carries its line itself, as an extended attribute, where the
// disk has such: the same command may be given again. Inside such a folder nothing is written or removed through a
// link.
#pragma once

#include "base/error.h"
#include "base/lock.h"

#define FS_OWNED_DIR ".flashsplat"

// An error for "/": all files of the machine would be below a folder of ours.
int fs_owned_check_place(const char *dir, FsError *err);
// Makes dir a folder of ours, of a kind: "project", "capture", "renders" (a folder inside one of ours, but not inside a
// capture, will do for renders). An error when it is one of another kind.
int fs_owned_open(const char *dir, const char *kind, FsError *err);
// For who writes into a project: false where another program does. Clears away what programs that are gone left half.
bool fs_owned_lock(const char *dir, Lock *lock);
// Takes the mark away again where nothing was written, and nobody else is about to; and the folders that were made for
// this, which begin at that length of dir (0: none). The lock is to be released after.
void fs_owned_leave(const char *dir, size_t made, Lock *lock);
// 0 when path may be written: nothing is there, or a file of ours. Else an error that says what is in the way.
int fs_owned_check(const char *path, FsError *err);
// A file that the user names by itself, by a command: only what that command wrote may be replaced. Signed once it is
// there; where the disk has no extended attributes, it is not replaced.
int fs_owned_check_single(const char *path, const char *command, FsError *err);
void fs_owned_sign(const char *path, const char *command);
int fs_owned_check_tree(const char *dir, FsError *err); // every file below dir is ours; 0 where nothing is there
bool fs_owned_is_result(const char *path);              // a file of ours, right in a folder of ours

// For file.c. Where made is to be: a name for it until it is whole (the caller frees).
char *fs_owned_temp(const char *path);
// Checks, and writes down that path gets the content of the file made. Outside our folders nothing is checked.
int fs_owned_record(const char *made, const char *path, FsError *err);
int fs_owned_record_dir(const char *path, FsError *err);
// Removes path, and what is below it, as far as it is ours. "DIR/." means all in a folder of ours.
void fs_owned_remove(const char *path);
