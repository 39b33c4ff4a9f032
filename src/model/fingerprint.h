// What a stage's results follow from: its settings, and a hash of the content of every input.
#pragma once

#include "model/project.h"

// As JSON text, {"settings": {...}, "inputs": {...}}; NULL when out of memory or the CPU lacks what is asked for. The
// caller frees. An input that is not there has no hash.
char *fs_fingerprint_make(const FsProject *project, const ProjectStage *stage);
// Of a file, or of what stages read in a folder and depth - 1 folders below it. False: nothing is there.
bool fs_fingerprint_hash(const char *path, int depth, char text[17]);
enum { FINGERPRINT_SETTINGS = 1, FINGERPRINT_INPUTS = 2 };
// Which of these differ; one that does, in words for the user, into text; 0: nothing does. An input without hash now is
// not compared: photos may be gone once they are ingested. was: anything that ought to be a fingerprint.
unsigned fs_fingerprint_differs(const char *was, const char *now, char *text, size_t size);
