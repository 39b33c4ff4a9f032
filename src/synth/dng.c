// DNG through libtiff.
#include <stdlib.h>
#include <string.h>

#include "image/profile.h"
#include "image/tiff_file.h"
#include "synth/photo_file.h"

static bool write_picture(TIFF *tif, const Mosaic *m, const float chosen[3])
{
    const double neutral[3] = SENSOR_NEUTRAL;
    float matrix[9], balance[3], exposure = 0.0f;
    for (int i = 0; i < 9; i++) matrix[i] = (float)(fs_profile_srgb_from_xyz[i] * neutral[i / 3]);
    for (int i = 0; i < 3; i++) balance[i] = (float)neutral[i] / chosen[i];
    const float black[1] = {SENSOR_BLACK};
    const uint32_t white[1] = {SENSOR_WHITE}, area[4] = {0, 0, (uint32_t)m->height, (uint32_t)m->width};
    const uint16_t pair[2] = {2, 2}, one[2] = {1, 1};
    bool ok =
        TIFFSetField(tif, TIFFTAG_SUBFILETYPE, 0) && TIFFSetField(tif, TIFFTAG_IMAGEWIDTH, m->width) &&
        TIFFSetField(tif, TIFFTAG_IMAGELENGTH, m->height) && TIFFSetField(tif, TIFFTAG_BITSPERSAMPLE, 16) &&
        TIFFSetField(tif, TIFFTAG_COMPRESSION, COMPRESSION_NONE) &&
        TIFFSetField(tif, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_CFA) && TIFFSetField(tif, TIFFTAG_SAMPLESPERPIXEL, 1) &&
        TIFFSetField(tif, TIFFTAG_ROWSPERSTRIP, m->height) &&
        TIFFSetField(tif, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) &&
        TIFFSetField(tif, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT) &&
        TIFFSetField(tif, TIFFTAG_CFAREPEATPATTERNDIM, pair) && TIFFSetField(tif, TIFFTAG_CFAPATTERN, 4, "\0\1\1\2") &&
        TIFFSetField(tif, TIFFTAG_CFAPLANECOLOR, 3, "\0\1\2") && TIFFSetField(tif, TIFFTAG_CFALAYOUT, 1) &&
        TIFFSetField(tif, TIFFTAG_DNGVERSION, "\1\4\0\0") &&
        TIFFSetField(tif, TIFFTAG_DNGBACKWARDVERSION, "\1\1\0\0") &&
        TIFFSetField(tif, TIFFTAG_UNIQUECAMERAMODEL, SHOT_MAKE " " SHOT_MODEL) &&
        TIFFSetField(tif, TIFFTAG_BLACKLEVELREPEATDIM, one) && TIFFSetField(tif, TIFFTAG_BLACKLEVEL, 1, black) &&
        TIFFSetField(tif, TIFFTAG_WHITELEVEL, 1, white) && TIFFSetField(tif, TIFFTAG_COLORMATRIX1, 9, matrix) &&
        TIFFSetField(tif, TIFFTAG_ASSHOTNEUTRAL, 3, balance) && TIFFSetField(tif, TIFFTAG_CALIBRATIONILLUMINANT1, 21) &&
        TIFFSetField(tif, TIFFTAG_BASELINEEXPOSURE, exposure) && TIFFSetField(tif, TIFFTAG_ACTIVEAREA, area);
    uint16_t *row = malloc((size_t)m->width * sizeof *row); // libtiff may swap bytes in place
    for (int y = 0; ok && row && y < m->height; y++) {
        memcpy(row, m->px + (size_t)y * (size_t)m->width, (size_t)m->width * sizeof *row);
        ok = TIFFWriteScanline(tif, row, (uint32_t)y, 0) == 1;
    }
    ok = ok && row;
    free(row);
    return ok;
}

static bool name_camera(TIFF *tif, const ShotInfo *info)
{
    char time[20];
    fs_photo_file_time(info, time);
    return TIFFSetField(tif, TIFFTAG_MAKE, SHOT_MAKE) && TIFFSetField(tif, TIFFTAG_MODEL, SHOT_MODEL) &&
           TIFFSetField(tif, TIFFTAG_SOFTWARE, SHOT_SOFTWARE) && TIFFSetField(tif, TIFFTAG_DATETIME, time) &&
           TIFFSetField(tif, TIFFTAG_XRESOLUTION, 72.0) && TIFFSetField(tif, TIFFTAG_YRESOLUTION, 72.0) &&
           TIFFSetField(tif, TIFFTAG_RESOLUTIONUNIT, RESUNIT_INCH);
}

static bool write_exif(TIFF *tif, const ShotInfo *info, uint64_t *offset)
{
    char time[20];
    fs_photo_file_time(info, time);
    const uint16_t iso[1] = {(uint16_t)info->exposure.iso};
    return TIFFCreateEXIFDirectory(tif) == 0 && TIFFSetField(tif, EXIFTAG_EXPOSURETIME, 1.0 / info->exposure.shutter) &&
           TIFFSetField(tif, EXIFTAG_FNUMBER, info->exposure.f_number) &&
           TIFFSetField(tif, EXIFTAG_EXPOSUREPROGRAM, 1) && TIFFSetField(tif, EXIFTAG_ISOSPEEDRATINGS, 1, iso) &&
           TIFFSetField(tif, EXIFTAG_EXIFVERSION, "0230") && TIFFSetField(tif, EXIFTAG_DATETIMEORIGINAL, time) &&
           TIFFSetField(tif, EXIFTAG_DATETIMEDIGITIZED, time) &&
           TIFFSetField(tif, EXIFTAG_FLASH, info->flash ? 9 : 16) &&
           TIFFSetField(tif, EXIFTAG_FOCALLENGTH, info->focal_mm) && TIFFSetField(tif, EXIFTAG_COLORSPACE, 1) &&
           TIFFSetField(tif, EXIFTAG_PIXELXDIMENSION, (uint32_t)info->width) &&
           TIFFSetField(tif, EXIFTAG_PIXELYDIMENSION, (uint32_t)info->height) &&
           TIFFSetField(tif, EXIFTAG_EXPOSUREMODE, 1) &&
           TIFFSetField(tif, EXIFTAG_WHITEBALANCE, !info->exposure.automatic) &&
           TIFFSetField(tif, EXIFTAG_FOCALLENGTHIN35MMFILM, info->focal_35mm) && TIFFWriteCustomDirectory(tif, offset);
}

int fs_dng_write(const char *path, const Mosaic *mosaic, const ShotInfo *info, FsError *err)
{
    TiffFile t;
    MUST(fs_tiff_file_begin(&t, path, "l", err));
    TIFF *tif = t.tiff;
    uint64_t exif = 0;
    // The picture's directory is written with room for the place of the EXIF directory, which follows it.
    bool ok = write_picture(tif, mosaic, info->exposure.balance) && name_camera(tif, info) &&
              TIFFSetField(tif, TIFFTAG_EXIFIFD, exif) && TIFFWriteDirectory(tif) && write_exif(tif, info, &exif) &&
              TIFFSetDirectory(tif, 0) && TIFFSetField(tif, TIFFTAG_EXIFIFD, exif) && TIFFRewriteDirectory(tif);
    return fs_tiff_file_commit(&t, ok, err);
}
