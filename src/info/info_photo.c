// Describes a photo from its EXIF.
#include "info/info.h"

int fs_info_photo(const char *path, const Log *log, FsError *err)
{
    (void)log;
    return fs_error_set(err, FS_ERR_INPUT, "%s: photos: not built yet", path);
}
