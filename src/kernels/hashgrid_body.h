// hashgrid.h in plain C: the scalar definition, and its twins by what the compiler makes of it for their instruction
// sets.

// The row of a vertex; hashed is known at compile time.
static inline uint32_t row_of(const HashLevel *level, int hashed, uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t side = (uint32_t)level->resolution + 1;
    return hashed ? (x ^ y * 2654435761u ^ z * 805459861u) & (level->rows - 1) : x + side * (y + side * z);
}

// The cell of a place along an axis, and how far into it the place is.
static inline int cell_of(const HashLevel *level, float at, float *part)
{
    float x = at * (float)level->resolution;
    int i = (int)x;
    i = i < level->resolution - 1 ? i : level->resolution - 1;
    *part = x - (float)i;
    return i;
}

static inline void encode_as(const HashLevel *level, int hashed, const float *table, const HashPlaces *places,
                             float *out, size_t stride)
{
    const float *px = places->at[0], *py = places->at[1], *pz = places->at[2];
    float *restrict first = out, *restrict second = out + stride;
    for (int i = 0; i < places->n; i++) {
        float fx, fy, fz, a = 0, b = 0;
        uint32_t x = (uint32_t)cell_of(level, px[i], &fx), y = (uint32_t)cell_of(level, py[i], &fy),
                 z = (uint32_t)cell_of(level, pz[i], &fz);
        for (uint32_t k = 0; k < 8; k++) {
            float w = (k & 1 ? fx : 1 - fx) * (k & 2 ? fy : 1 - fy) * (k & 4 ? fz : 1 - fz);
            uint32_t row = row_of(level, hashed, x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
            a += w * table[2 * row];
            b += w * table[2 * row + 1];
        }
        first[i] = a;
        second[i] = b;
    }
}

static void encode(const HashLevel *level, const float *table, const HashPlaces *places, float *out, size_t stride)
{
    if (level->hashed)
        encode_as(level, 1, table, places, out, stride);
    else
        encode_as(level, 0, table, places, out, stride);
}

static inline void scatter_as(const HashLevel *level, int hashed, const HashPlaces *places, const float *d_out,
                              size_t stride, float *d_table, unsigned char *touched)
{
    for (int i = 0; i < places->n; i++) {
        float fx, fy, fz, a = d_out[i], b = d_out[stride + (size_t)i];
        if (a == 0 && b == 0) continue; // behind what is opaque
        uint32_t x = (uint32_t)cell_of(level, places->at[0][i], &fx),
                 y = (uint32_t)cell_of(level, places->at[1][i], &fy),
                 z = (uint32_t)cell_of(level, places->at[2][i], &fz);
        for (uint32_t k = 0; k < 8; k++) {
            float w = (k & 1 ? fx : 1 - fx) * (k & 2 ? fy : 1 - fy) * (k & 4 ? fz : 1 - fz);
            uint32_t row = row_of(level, hashed, x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
            d_table[2 * row] += w * a;
            d_table[2 * row + 1] += w * b;
            touched[row] = 1;
        }
    }
}

static void scatter(const HashLevel *level, const HashPlaces *places, const float *d_out, size_t stride, float *d_table,
                    unsigned char *touched)
{
    if (level->hashed)
        scatter_as(level, 1, places, d_out, stride, d_table, touched);
    else
        scatter_as(level, 0, places, d_out, stride, d_table, touched);
}
