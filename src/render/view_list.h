// Which views to render: the posed photos, the views of a camera model, or the frames of a spiral path.
#pragma once

#include "model/dataset.h"
#include "model/project.h"
#include "render/spiral.h"

// Cameras at the size to render, ready for output files: names are plain and differ from one another.
// The posed photos themselves, no larger than the setting long-edge where the user gave it.
int fs_view_list_of_photos(const FsProject *project, const Dataset *photos, Dataset *views, FsError *err);
// The setting cameras. Sizes: the working size of `photos`, or the setting long-edge where the user gave it. own_place:
// the renders go where the photos' are.
int fs_view_list_of_model(const FsProject *project, const Dataset *photos, bool own_place, Dataset *views,
                          FsError *err);
// The setting path-views: frames path_0001 ... around the photos' cameras.
int fs_view_list_of_spiral(const FsProject *project, const Dataset *photos, double nearest, double farthest,
                           Dataset *views, FsError *err);

// A camera model given for rendering may sit in another frame than the capture (other origin, turn and scale): moves
// the cameras of views into the frame of photos where views of the same name say so; says what it did. Views that agree
// already, or too few in common to tell, are left as they are. Those that disagree are, with a warning; in the photos'
// own place (own_place) that is an error. file: the model's path, for the messages.
int fs_frame_align(Dataset *views, const Dataset *photos, const char *file, bool own_place, const Log *log,
                   FsError *err);
