// A stroke alphabet.
#include "synth/letters.h"

#include <stddef.h>
#include <string.h>

static const char *const letters[26] = {
    "062046 1434",               // A
    "00063645443303 3342413000", // B
    "4130100105163645",          // C
    "00062644422000",            // D
    "40000646 0333",             // E
    "400006 0333",               // F
    "41301001051636454323",      // G
    "0006 4046 0343",            // H
    "2026",                      // I
    "4045361605",                // J
    "0006 400346",               // K
    "000646",                    // L
    "0600234046",                // M
    "06004640",                  // N
    "103041453616050110",        // O
    "06003041423303",            // P
    "103041453616050110 2446",   // Q
    "06003041423303 2346",       // R
    "413010010213334445361605",  // S
    "0040 2026",                 // T
    "000516364540",              // U
    "002640",                    // V
    "0016233640",                // W
    "0046 4006",                 // X
    "002340 2326",               // Y
    "00400646",                  // Z
};

static const char *const digits[10] = {
    "103041453616050110 1432",             // 0
    "112026",                              // 1
    "01103041420646",                      // 2
    "01103041423323 334445361605",         // 3
    "36300444",                            // 4
    "400003334445361605",                  // 5
    "4130100105163645443303",              // 6
    "004016",                              // 7
    "103041423313020110 1304051636454433", // 8
    "051636454130100102 1343",             // 9
};

static const char *const words[] = {
    "MUSEUM", "RIVER",   "NORTH",   "GARDEN", "SIGNAL",  "MARKET", "PAPER",  "HARBOUR", "COFFEE", "ORANGE", "THEATRE",
    "LIGHT",  "SUMMER",  "ARCHIVE", "BRIDGE", "FOREST",  "CITY",   "WINTER", "STUDIO",  "PRESS",  "OCEAN",  "MOTOR",
    "VOLUME", "EDITION", "QUARTZ",  "SILVER", "PLANET",  "COPPER", "WINDOW", "MEADOW",  "CASTLE", "RADIO",  "TEA",
    "FRESH",  "GRAND",   "EXHIBIT", "JAZZ",   "ISLAND",  "COTTON", "MAPLE",  "POLAR",   "ATLAS",  "DELTA",  "FABRIC",
    "ENERGY", "NIGHT",   "KITCHEN", "TRAVEL", "HISTORY", "DESIGN", "WEAVER", "PHYSICS", "SODA",   "OLIVE",  "BAKERY",
    "24",     "1987",    "NO 7",    "OPEN",   "ROOM 12", "500 G",  "DAILY",  "FILM",    "ZEBRA",  "HOTEL",  "SPRING",
};

const char *fs_letters_strokes(char c)
{
    if (c >= 'A' && c <= 'Z') return letters[c - 'A'];
    if (c >= '0' && c <= '9') return digits[c - '0'];
    return NULL;
}

const char *fs_letters_word(Rng *rng)
{
    return words[fs_rng_below(rng, (int)(sizeof words / sizeof *words))];
}

void fs_letters_words(Rng *rng, int count, char *buf, int n)
{
    int used = 0;
    for (int i = 0; i < count; i++) {
        const char *word = fs_letters_word(rng);
        int length = (int)strlen(word);
        if (used + length + 2 > n) break;
        if (used) buf[used++] = ' ';
        memcpy(buf + used, word, (size_t)length);
        used += length;
    }
    buf[used] = 0;
}
