// veil.h in plain C: the scalar definition, and its twins by what the compiler makes of it for their instruction sets.
typedef struct Place {
    size_t at;      // the cell up and left
    float share[4]; // of it, of the next column, of the next row, of both
    float falloff;  // of the flash's light
} Place;

// Shares of 0: the ray does not meet the texture.
static inline Place place(const VeilView *v, int x, int y)
{
    Place p = {0};
    float ray[3];
    for (int k = 0; k < 3; k++) ray[k] = v->base[k] + (float)x * v->dx[k] + (float)y * v->dy[k];
    if (!(ray[2] > 0)) return p;
    float column = v->at[0] + v->per * (ray[0] / ray[2]), row = v->at[1] + v->per * (ray[1] / ray[2]);
    if (!(column >= 0 && column < (float)(v->width - 1) && row >= 0 && row < (float)(v->height - 1))) return p;
    int i = (int)column, j = (int)row;
    float a = column - (float)i, b = row - (float)j;
    p.at = (size_t)j * (size_t)v->width + (size_t)i;
    p.share[0] = (1 - a) * (1 - b);
    p.share[1] = a * (1 - b);
    p.share[2] = (1 - a) * b;
    p.share[3] = a * b;
    p.falloff = ray[2] * ray[2] / (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]);
    return p;
}

static inline float between(const Place *p, const float *texture, size_t down)
{
    const float *t = texture + p->at;
    return p->share[0] * t[0] + p->share[1] * t[1] + p->share[2] * t[down] + p->share[3] * t[down + 1];
}

static void forward(const VeilView *v, const float *texture, const Planes *veil, int y0, int y1)
{
    for (int y = y0; y < y1; y++)
        for (int x = 0; x < veil->width; x++) {
            Place p = place(v, x, y);
            float t = v->width ? between(&p, texture, (size_t)v->width) : 0;
            for (int c = 0; c < 3; c++) fs_planes_row(veil, c, y)[x] = (v->ambient[c] + v->light[c] * p.falloff) * t;
        }
}

static void backward(const VeilView *v, const float *texture, const Planes *d_veil, float *d_texture,
                     double d_ambient[3], int y0, int y1)
{
    const size_t down = (size_t)v->width;
    for (int y = y0; y < y1 && down; y++) {
        float part[3] = {0, 0, 0};
        for (int x = 0; x < d_veil->width; x++) {
            Place p = place(v, x, y);
            float *t = d_texture + p.at, seen = d_ambient ? between(&p, texture, down) : 0, d_t = 0;
            for (int c = 0; c < 3; c++) {
                float d = fs_planes_row(d_veil, c, y)[x];
                part[c] += d * seen;
                d_t += d * (v->ambient[c] + v->light[c] * p.falloff);
            }
            t[0] += p.share[0] * d_t;
            t[1] += p.share[1] * d_t;
            t[down] += p.share[2] * d_t;
            t[down + 1] += p.share[3] * d_t;
        }
        for (int c = 0; c < 3 && d_ambient; c++) d_ambient[c] += (double)part[c];
    }
}
