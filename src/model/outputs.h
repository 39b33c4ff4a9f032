// The files that a stage leaves in OUT, by the patterns of fs_project_stages: % is each view, & each cloud, * whatever
// is there.
#pragma once

#include <jansson.h>
#include <stdbool.h>

#include "base/error.h"

// What % may be.
typedef struct OutputNames {
    const char *const *view;
    int n;
    json_t *ingested; // who has the names, where they are those of ingest.json
} OutputNames;

int fs_outputs_names(OutputNames *names, const char *out, FsError *err); // none where nothing was ingested
void fs_outputs_free(OutputNames *names);
// An error when something of the user's is where a pattern says.
int fs_outputs_check(const char *out, const char *pattern, const OutputNames *names, FsError *err);
// How many files there are of each pattern that has any, up to NULL; NULL when out of memory.
json_t *fs_outputs_count(const char *out, const char *const *patterns, FsError *err);
// Whether there are no fewer than were counted. was: NULL when nothing was.
bool fs_outputs_are_there(const char *out, const char *const *patterns, const json_t *was);
