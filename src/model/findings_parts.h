// What the files that make findings share. marked: (n) which photos a finding is of.
#pragma once

#include "model/findings.h"

__attribute__((format(printf, 4, 5))) void fs_findings_add(Findings *f, const char *kind, FindingWeight weight,
                                                           const char *format, ...);
// "a, b, c and 4 more" of those that are marked.
const char *fs_findings_names(const Photos *photos, const bool *marked, char text[200]);
int fs_findings_count(const bool *marked, int n);

// All that is told by the camera's settings. value: (n) scratch.
void fs_findings_camera(Findings *f, const Photos *photos, double *value, bool *marked);
// Marks the photos of another focal length. focal: (n) scratch.
void fs_findings_camera_zoomed(const Photos *photos, double *focal, bool *marked);
