// What photos have in common, by their small pictures: which show one place twice, and which another place than the
// rest.
#pragma once

#include "model/photos.h"

// The photos' looks and flash states must be there. Fills twin_of (of those that show what an earlier photo of the same
// lighting shows: no part of the picture has moved against the others) and stranger (nothing in it is found again in
// the rest, where the rest hang together).
int fs_alike_compare(Photos *photos, FsError *err);
