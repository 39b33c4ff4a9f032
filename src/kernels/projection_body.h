// The maths of projection.h, written once over `real`: float (the scalar definition), double (gradient checks) or a
// vector with one Gaussian per lane. The includer defines real, r_set, r_sqrt, r_exp, r_log2, r_max, r_min,
// r_where (|a| <= limit ? b : 0) and LANES.
#define LOG2E 1.4426950408889634f

typedef struct Gaussian { // parameters, or their gradients
    real mean[3], scale[3], quat[4], opacity;
} Gaussian;

typedef struct Projection {   // what backward reuses of forward
    real p[3], inv_z, tx, ty; // camera space, x/z and y/z clamped
    real rq[9], s[3], q[4], inv_norm;
    real w0[3], w1[3]; // rows of J R
    real q0[3], q1[3]; // rows of J R Rq
    real xx, xy, yy;   // covariance
    real a, b, c;      // conic
} Projection;

FN void rotation_of(const real q[4], real r[9])
{
    real w = q[0], x = q[1], y = q[2], z = q[3], one = r_set(1), two = r_set(2);
    r[0] = one - two * (y * y + z * z);
    r[1] = two * (x * y - w * z);
    r[2] = two * (x * z + w * y);
    r[3] = two * (x * y + w * z);
    r[4] = one - two * (x * x + z * z);
    r[5] = two * (y * z - w * x);
    r[6] = two * (x * z - w * y);
    r[7] = two * (y * z + w * x);
    r[8] = one - two * (x * x + y * y);
}

FN void project(const ProjectCamera *cam, const Gaussian *g, Projection *o)
{
    for (int i = 0; i < 3; i++)
        o->p[i] = r_set(cam->rotation[3 * i]) * g->mean[0] + r_set(cam->rotation[3 * i + 1]) * g->mean[1] +
                  r_set(cam->rotation[3 * i + 2]) * g->mean[2] + r_set(cam->translation[i]);
    o->inv_z = r_set(1) / r_max(o->p[2], r_set(cam->near)); // below near: invisible, kept finite
    o->tx = r_max(r_min(o->p[0] * o->inv_z, r_set(cam->limit_x)), r_set(-cam->limit_x));
    o->ty = r_max(r_min(o->p[1] * o->inv_z, r_set(cam->limit_y)), r_set(-cam->limit_y));
    real norm2 = g->quat[0] * g->quat[0] + g->quat[1] * g->quat[1] + g->quat[2] * g->quat[2] + g->quat[3] * g->quat[3];
    o->inv_norm = r_set(1) / r_sqrt(r_max(norm2, r_set(1e-24f)));
    for (int i = 0; i < 4; i++) o->q[i] = g->quat[i] * o->inv_norm;
    rotation_of(o->q, o->rq);
    real jx = r_set(cam->fx) * o->inv_z, jy = r_set(cam->fy) * o->inv_z;
    for (int k = 0; k < 3; k++) {
        o->w0[k] = jx * (r_set(cam->rotation[k]) - o->tx * r_set(cam->rotation[6 + k]));
        o->w1[k] = jy * (r_set(cam->rotation[3 + k]) - o->ty * r_set(cam->rotation[6 + k]));
    }
    const real ex = r_set(cam->dilation_x), ey = r_set(cam->dilation_y);
    real v0[3], v1[3];
    o->xx = ex;
    o->yy = ey;
    o->xy = r_set(0);
    for (int k = 0; k < 3; k++) {
        o->s[k] = r_exp(g->scale[k]);
        o->q0[k] = o->w0[0] * o->rq[k] + o->w0[1] * o->rq[3 + k] + o->w0[2] * o->rq[6 + k];
        o->q1[k] = o->w1[0] * o->rq[k] + o->w1[1] * o->rq[3 + k] + o->w1[2] * o->rq[6 + k];
        v0[k] = o->q0[k] * o->s[k], v1[k] = o->q1[k] * o->s[k];
        o->xx += v0[k] * v0[k];
        o->xy += v0[k] * v1[k];
        o->yy += v1[k] * v1[k];
    }
    // det(V V^T + e) as a sum of squares: xx yy - xy^2 of a long thin splat at 45 degrees would cancel to nothing.
    real m0 = v0[1] * v1[2] - v0[2] * v1[1], m1 = v0[2] * v1[0] - v0[0] * v1[2], m2 = v0[0] * v1[1] - v0[1] * v1[0];
    real inv_det = r_set(1) / (m0 * m0 + m1 * m1 + m2 * m2 + ex * (o->yy - ey) + ey * o->xx);
    o->a = o->yy * inv_det;
    o->b = r_set(0) - o->xy * inv_det;
    o->c = o->xx * inv_det;
}

FN real log2_sigmoid(real x) // -log2(1 + e^-x)
{
    return r_set(0) - r_log2(r_set(1) + r_exp(r_set(0) - r_max(x, r_set(-40))));
}

// m: the six moments; A, B, C as in raster.h; d_z: gradient of depth.
FN void project_back(const ProjectCamera *cam, const Gaussian *g, const real m[6], real d_z, Gaussian *d)
{
    Projection o;
    project(cam, g, &o);
    const real k2 = r_set(-0.5f * LOG2E), zero = r_set(0);
    real A = k2 * o.a, B = r_set(2) * k2 * o.b, C = k2 * o.c;
    real d_x = zero - (r_set(2) * A * m[1] + B * m[2]), d_y = zero - (r_set(2) * C * m[2] + B * m[1]);
    // conic -> covariance: dCov = -K G K with G = [[da, db/2], [db/2, dc]]
    real ga = k2 * m[3], gb = k2 * m[4], gc = k2 * m[5]; // gb = db / 2
    real h0 = o.a * ga + o.b * gb, h1 = o.a * gb + o.b * gc, h2 = o.b * ga + o.c * gb, h3 = o.b * gb + o.c * gc;
    real d_xx = zero - (h0 * o.a + h1 * o.b), d_xy = zero - (h0 * o.b + h1 * o.c) - (h2 * o.a + h3 * o.b),
         d_yy = zero - (h2 * o.b + h3 * o.c);
    real d_rq[9], d_w0[3] = {zero, zero, zero}, d_w1[3] = {zero, zero, zero};
    for (int k = 0; k < 3; k++) {
        real v0 = o.q0[k] * o.s[k], v1 = o.q1[k] * o.s[k];
        real d_v0 = r_set(2) * d_xx * v0 + d_xy * v1, d_v1 = d_xy * v0 + r_set(2) * d_yy * v1;
        d->scale[k] = d_v0 * v0 + d_v1 * v1;
        real d_q0 = d_v0 * o.s[k], d_q1 = d_v1 * o.s[k];
        for (int j = 0; j < 3; j++) {
            d_rq[3 * j + k] = o.w0[j] * d_q0 + o.w1[j] * d_q1;
            d_w0[j] += o.rq[3 * j + k] * d_q0;
            d_w1[j] += o.rq[3 * j + k] * d_q1;
        }
    }
    // J R: w0 = jx (R0 - tx R2), w1 = jy (R1 - ty R2), jx = fx / z
    real jx = r_set(cam->fx) * o.inv_z, jy = r_set(cam->fy) * o.inv_z, d_tx = zero, d_ty = zero, d_lz = zero;
    for (int k = 0; k < 3; k++) {
        d_tx -= d_w0[k] * jx * r_set(cam->rotation[6 + k]);
        d_ty -= d_w1[k] * jy * r_set(cam->rotation[6 + k]);
        d_lz -= d_w0[k] * o.w0[k] + d_w1[k] * o.w1[k]; // d jx / d ln z = -jx
    }
    d_tx = r_where(o.p[0] * o.inv_z, r_set(cam->limit_x), d_tx);
    d_ty = r_where(o.p[1] * o.inv_z, r_set(cam->limit_y), d_ty);
    // pixel = f p/z + c, and tx = x/z where not clamped
    real gx = d_x * r_set(cam->fx) + d_tx, gy = d_y * r_set(cam->fy) + d_ty;
    real d_p[3] = {gx * o.inv_z, gy * o.inv_z, d_z + (d_lz - gx * o.p[0] * o.inv_z - gy * o.p[1] * o.inv_z) * o.inv_z};
    for (int k = 0; k < 3; k++)
        d->mean[k] = r_set(cam->rotation[k]) * d_p[0] + r_set(cam->rotation[3 + k]) * d_p[1] +
                     r_set(cam->rotation[6 + k]) * d_p[2];
    // rotation matrix -> unit quaternion -> quaternion
    const real *r = d_rq, two = r_set(2), four = r_set(4);
    real w = o.q[0], x = o.q[1], y = o.q[2], z = o.q[3], dq[4];
    dq[0] = two * (z * (r[3] - r[1]) + y * (r[2] - r[6]) + x * (r[7] - r[5]));
    dq[1] = two * (y * (r[1] + r[3]) + z * (r[2] + r[6]) + w * (r[7] - r[5])) - four * x * (r[4] + r[8]);
    dq[2] = two * (x * (r[1] + r[3]) + z * (r[5] + r[7]) + w * (r[2] - r[6])) - four * y * (r[0] + r[8]);
    dq[3] = two * (x * (r[2] + r[6]) + y * (r[5] + r[7]) + w * (r[3] - r[1])) - four * z * (r[0] + r[4]);
    real along = dq[0] * w + dq[1] * x + dq[2] * y + dq[3] * z;
    for (int k = 0; k < 4; k++) d->quat[k] = (dq[k] - along * o.q[k]) * o.inv_norm;
    // L = log2 sigmoid: dL/dlogit = log2(e) (1 - sigmoid)
    real e = r_exp(zero - r_max(g->opacity, r_set(-40)));
    d->opacity = m[0] * r_set(LOG2E) * e / (r_set(1) + e);
}
