// A camera model given for rendering may sit in another frame than the capture (other origin, turn and scale): found
// by the views both have, and undone.
#pragma once

#include "base/log.h"
#include "model/dataset.h"

// Moves the cameras of views into the frame of photos where views of the same name say so; says what it did. Views that
// agree already, or too few in common to tell, are left as they are. file: the model's path, for the messages.
int fs_frame_align(Dataset *views, const Dataset *photos, const char *file, const Log *log, FsError *err);
