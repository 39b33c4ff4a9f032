// The faults of a capture as people bring it home, by name: the setting "field".
#pragma once

#include <stdbool.h>

#include "base/error.h"

typedef enum FieldFault {
    FIELD_FLASH_JITTER,
    FIELD_DRIFT,
    FIELD_SHUTTER,
    FIELD_VIGNETTING,
    FIELD_JPEG,
    FIELD_WHITE_BALANCE,
    FIELD_UNDER,
    FIELD_DISTORTION,
    FIELD_SHAKE,
    FIELD_DEFOCUS,
    FIELD_PHOTOGRAPHER,
    FIELD_PEDESTRIAN,
    FIELD_DIRT,
    FIELD_DOUBLE_GLAZING,
    FIELD_TINT,
    FIELD_MIRRORED_FLASH,
    FIELD_FAULTS
} FieldFault;

typedef struct Field {
    bool any;
    float strength[FIELD_FAULTS]; // 0: without this fault
} Field;

int fs_field_read(Field *field, const char *list, FsError *err); // FS_ERR_USAGE where a name is none
const char *fs_field_name(FieldFault fault);                     // "flash-jitter"
