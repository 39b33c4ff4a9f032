// veil.h in plain C: the scalar definition, and its twins by what the compiler makes of it for their instruction sets.
typedef struct Place {
    size_t at;      // the cell up and left, first of its channels in the texture
    float share[4]; // of it, of the next column, of the next row, of both
    float light;    // of the flash
} Place;

// 0: the ray does not meet the texture.
static inline int place(const VeilView *v, int x, int y, Place *p)
{
    float ray[3];
    for (int k = 0; k < 3; k++) ray[k] = v->base[k] + (float)x * v->dx[k] + (float)y * v->dy[k];
    if (!(ray[2] > 0)) return 0;
    float column = v->at[0] + v->per * (ray[0] / ray[2]), row = v->at[1] + v->per * (ray[1] / ray[2]);
    if (!(column >= 0 && column < (float)(v->width - 1) && row >= 0 && row < (float)(v->height - 1))) return 0;
    int i = (int)column, j = (int)row;
    float a = column - (float)i, b = row - (float)j;
    p->at = 3 * ((size_t)j * (size_t)v->width + (size_t)i);
    p->share[0] = (1 - a) * (1 - b);
    p->share[1] = a * (1 - b);
    p->share[2] = (1 - a) * b;
    p->share[3] = a * b;
    p->light = v->light * ray[2] * ray[2] / (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]);
    return 1;
}

static inline float between(const Place *p, const float *t, size_t down) // t: one channel, from the first cell on
{
    return p->share[0] * t[0] + p->share[1] * t[3] + p->share[2] * t[down] + p->share[3] * t[down + 3];
}

static void forward(const VeilView *v, const float *texture, const Planes *veil, int y0, int y1)
{
    const size_t down = 3 * (size_t)v->width;
    for (int y = y0; y < y1; y++)
        for (int x = 0; x < veil->width; x++) {
            Place p;
            int met = place(v, x, y, &p);
            for (int c = 0; c < 3; c++)
                fs_planes_row(veil, c, y)[x] =
                    met ? (v->ambient[c] + p.light) * between(&p, texture + p.at + c, down) : 0;
        }
}

static void backward(const VeilView *v, const float *texture, const Planes *d_veil, float *d_texture,
                     double d_ambient[3], int y0, int y1)
{
    const size_t down = 3 * (size_t)v->width;
    for (int y = y0; y < y1; y++) {
        float part[3] = {0, 0, 0};
        for (int x = 0; x < d_veil->width; x++) {
            Place p;
            if (!place(v, x, y, &p)) continue;
            for (int c = 0; c < 3; c++) {
                float *t = d_texture + p.at + c, d = fs_planes_row(d_veil, c, y)[x];
                if (d_ambient) part[c] += d * between(&p, texture + p.at + c, down);
                d *= v->ambient[c] + p.light;
                t[0] += p.share[0] * d;
                t[3] += p.share[1] * d;
                t[down] += p.share[2] * d;
                t[down + 3] += p.share[3] * d;
            }
        }
        for (int c = 0; c < 3 && d_ambient; c++) d_ambient[c] += (double)part[c];
    }
}
