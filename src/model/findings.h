// What is wrong with a capture, from what its photos' headers and pictures tell: for `check` and for `ingest`.
#pragma once

#include "model/photos.h"

typedef enum FindingWeight { FINDING_HINT, FINDING_DOUBT, FINDING_UNUSABLE } FindingWeight;

typedef struct Finding {
    const char *kind; // one word, for JSON
    FindingWeight weight;
    char text[500]; // what is wrong, and what to do
} Finding;

typedef struct Findings {
    Finding *finding;
    int n;
    double flash_adds; // light of a flash photo over that of its neighbours without, less 1; NAN: unknown
} Findings;

// The photos' flash states, looks and lights must be there; puts them in the order in which they were taken, and fills
// their sharpness, and what is beside and like them.
int fs_findings_make(Findings *findings, Photos *photos, FsError *err);
FindingWeight fs_findings_worst(const Findings *findings);
void fs_findings_free(Findings *findings);
