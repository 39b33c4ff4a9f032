// Tells the user when a trained scene shows that the separation failed: measured on the renders at the photos' poses.
#pragma once

#include "base/log.h"
#include "engine/engine.h"

typedef struct Verdict {
    int views, photos;
    double lost, pixels;     // where T_N is black beside a bright T_F; all
    double t, r, i;          // sums of T_N, R, I_N
    double error2, compared; // photo against composite, tone-mapped: squared error, samples
} Verdict;

// One photo's pose. composite: as its camera shows it (as_shot.h). photo (with its mask, one channel; NULL: all is to
// be trusted) may be NULL or of another size: then it is not compared.
void fs_verdict_add(Verdict *verdict, const Renders *renders, const Image *composite, const Image *photo,
                    const Image *mask);
void fs_verdict_tell(const Verdict *verdict, const Log *log);
