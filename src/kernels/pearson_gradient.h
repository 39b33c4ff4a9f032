// The gradient pass of pearson.h over `row`, which the includer defines: scalar or SIMD.
static void gradient(const PearsonArgs *args, const PearsonSums *total, int y0, int y1)
{
    const Planes *X = args->X_linear, *Y = args->Y_linear;
    PearsonFit fit = fs_pearson_fit(total);
    PearsonLine of_x = fs_pearson_line(&fit, args->weight, false), of_y = fs_pearson_line(&fit, args->weight, true);
    for (int c = 0; c < X->channels; c++)
        for (int y = y0; y < y1; y++) {
            const float *px = fs_planes_row(X, c, y), *py = fs_planes_row(Y, c, y);
            if (args->d_X) row(fs_planes_row(args->d_X, c, y), fs_planes_row(args->X, c, y), px, py, X->width, &of_x);
            if (args->d_Y) row(fs_planes_row(args->d_Y, c, y), fs_planes_row(args->Y, c, y), py, px, X->width, &of_y);
        }
}
