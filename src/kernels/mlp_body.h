// The maths of mlp.h in the words of real_scalar.h and real_simd.h: samples in lanes.

// out (4, two vectors) = a (4, n) b (n, two vectors); a[r, k] = a[r * row + k * column].
FN void tile(const float *a, size_t row, size_t column, int n, const float *b, size_t stride, real out[4][2])
{
    for (int r = 0; r < 4; r++) out[r][0] = out[r][1] = r_set(0);
    for (int k = 0; k < n; k++) {
        const real left = r_load(b + (size_t)k * stride), right = r_load(b + (size_t)k * stride + LANES);
        for (int r = 0; r < 4; r++) {
            const real w = r_set(a[(size_t)r * row + (size_t)k * column]);
            out[r][0] += w * left;
            out[r][1] += w * right;
        }
    }
}

static void layer_forward(const MlpLayer *l, bool rectify, const float *x, float *y)
{
    const size_t columns = (size_t)l->columns;
    for (size_t s = 0; s < l->stride; s += 2 * LANES)
        for (int r = 0; r < l->rows; r += 4) {
            real out[4][2];
            tile(l->w + (size_t)r * columns, columns, 1, l->columns, x + s, l->stride, out);
            for (int k = 0; k < 4; k++)
                for (int h = 0; h < 2; h++)
                    r_store(y + (size_t)(r + k) * l->stride + s + (size_t)(h * LANES),
                            rectify ? r_max(out[k][h], r_set(0)) : out[k][h]);
        }
}

static void layer_back(const MlpLayer *l, const float *d_y, const float *x, float *d_x)
{
    for (size_t s = 0; s < l->stride; s += 2 * LANES)
        for (int c = 0; c < l->columns; c += 4) {
            real out[4][2];
            tile(l->w + c, 1, (size_t)l->columns, l->rows, d_y + s, l->stride, out);
            for (int k = 0; k < 4; k++)
                for (int h = 0; h < 2; h++) {
                    size_t at = (size_t)(c + k) * l->stride + s + (size_t)(h * LANES);
                    r_store(d_x + at, x ? r_below(r_set(0), r_load(x + at), out[k][h]) : out[k][h]);
                }
        }
}

static void layer_weights(const MlpLayer *l, const float *d_y, const float *x, float *d_w)
{
    for (int r = 0; r < l->rows; r += 4)
        for (int c = 0; c < l->columns; c += 2) {
            real sum[4][2];
            for (int k = 0; k < 4; k++) sum[k][0] = sum[k][1] = r_set(0);
            const float *x0 = x + (size_t)c * l->stride, *x1 = c + 1 < l->columns ? x0 + l->stride : x0;
            for (size_t s = 0; s < l->stride; s += LANES) {
                const real left = r_load(x0 + s), right = r_load(x1 + s);
                for (int k = 0; k < 4; k++) {
                    const real d = r_load(d_y + (size_t)(r + k) * l->stride + s);
                    sum[k][0] += d * left;
                    sum[k][1] += d * right;
                }
            }
            for (int k = 0; k < 4; k++)
                for (int h = 0; h < 2 && c + h < l->columns; h++)
                    d_w[(size_t)(r + k) * (size_t)l->columns + (size_t)(c + h)] += r_sum(sum[k][h]);
        }
}
