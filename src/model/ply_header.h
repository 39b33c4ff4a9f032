// The header of a PLY of any maker: its elements and their properties.
#pragma once

#include "base/error.h"

enum { PLY_ELEMENTS = 8, PLY_PROPERTIES = 96, PLY_NAMES = 400 };

typedef enum PlyType { PLY_NONE, PLY_I8, PLY_U8, PLY_I16, PLY_U16, PLY_I32, PLY_U32, PLY_F32, PLY_F64 } PlyType;

typedef struct PlyProperty {
    char name[32];
    PlyType type; // PLY_NONE: a list, or of a type that is not known
    size_t offset;
} PlyProperty;

typedef struct PlyElement {
    char name[64];
    long long count;
    int n_properties; // the first of them are in property
    PlyProperty property[PLY_PROPERTIES];
    size_t bytes;               // of one, in a binary file; 0 when a list makes it vary
    char properties[PLY_NAMES]; // their names, for people
} PlyElement;

typedef struct PlyHeader {
    char format[64]; // "ascii", "binary_little_endian", "binary_big_endian"
    PlyElement element[PLY_ELEMENTS];
    int n;
    long bytes; // of the header
} PlyHeader;

// Counts are as the file says them: who reads the rest checks them against its size.
int fs_ply_header_read(const char *path, PlyHeader *ply, FsError *err);
size_t fs_ply_header_bytes(PlyType type); // of a number; 0 of PLY_NONE
