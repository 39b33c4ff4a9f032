// The painted textures: what posters, cartons, book spines, cloth, wood and walls look like.
#pragma once

#include "synth/texture.h"

typedef enum Paint {
    PAINT_POSTER,  // heading, pictures, charts, columns of text
    PAINT_ART,     // an abstract or landscape painting
    PAINT_NEWS,    // a newspaper's page
    PAINT_COVER,   // magazine or book cover
    PAINT_LABEL,   // side of a carton or a tin: band, big word, small print
    PAINT_CARTON,  // corrugated board with stamps and tape
    PAINT_BOOKS,   // a row of book spines
    PAINT_FABRIC,  // woven check
    PAINT_FLORAL,  // dots and flowers on cloth
    PAINT_WOOD,    // grain along v
    PAINT_PLASTER, // wall paint with faint mottling
    PAINT_STAINED, // an old wall: mottling, cracks, stains
    PAINT_PANELS,  // wall panels with joints
    PAINT_BRICK,   //
    PAINT_TILES,   // square tiles
    PAINT_CARPET,  // coarse speckle
    PAINT_STONE,   // grey granite-like speckle
    PAINT_STRIPES, //
    PAINT_CHECKER, //
    PAINT_METAL,   // brushed, scratched
    PAINT_DOOR,    // leaf with panes or fillings and a handle
    PAINT_NOTES,   // pin board with slips of paper
    PAINT_BASKET,  // wickerwork
    PAINT_KEYS,    // rows of buttons (keyboard, remote control)
    PAINT_PLAIN,   // one colour, hardly any texture
    PAINTS
} Paint;

// hue 0..1 steers the main colour, negative: any. Negative result: out of memory.
int fs_paint_texture(Texture *texture, Paint paint, float hue, float w_cm, float h_cm, float px_per_cm, Rng *rng);
