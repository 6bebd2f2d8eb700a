/* Made-up kernels with the interfaces of emitted ones: the scalar ones, or the batch ones. Before this text stand
 *
 *   REAL, NAME(x)          number type, and a name with its prefix
 *   DOF, PARAMETER         number of joint values, whether there is the runtime parameter `offset`
 *   TIPS, SEVERAL          number of tips, whether the result has an axis for them
 *   BATCHES                whether this is the file of batch kernels
 *
 * Number r of frame f is q[r % DOF] * (r + 1) + (f + offset).
 */
#if DOF
#define POINT(r) q[(r) % DOF]
#define Q const REAL *q,
#define PASS_Q point,
#else
#define POINT(r) ((REAL)1)
#define Q
#define PASS_Q
#endif

#if PARAMETER
#define PARAMS const NAME(params) *params,
#define PASS_PARAMS params,
#define OFFSET params->offset
#else
#define PARAMS
#define PASS_PARAMS
#define OFFSET ((REAL)0)
#endif

#define NUMBER(f, r) (POINT(r) * (REAL)((r) + 1) + ((REAL)(f) + OFFSET))

#if !BATCHES
static void poses(Q PARAMS int frames, REAL *out)
{
    for (int f = 0; f < frames; ++f) {
        for (int r = 0; r < 16; ++r) out[16 * f + r] = r < 12 ? NUMBER(f, r) : (REAL)(r == 15);
    }
}

static void points(Q PARAMS int frames, REAL *out)
{
    for (int f = 0; f < frames; ++f) {
        for (int r = 0; r < 3; ++r) out[3 * f + r] = NUMBER(f, r);
    }
}

#if DOF
#define HEAD const REAL q[DOF],
#define KEEP q,
#else
#define HEAD
#define KEEP
#endif

#if SEVERAL
#define RESULT(width) REAL out[TIPS][width]
#else
#define RESULT(width) REAL out[width]
#endif

void NAME(fk)(HEAD PARAMS RESULT(16)) { poses(KEEP PASS_PARAMS TIPS, (REAL *)out); }
void NAME(frames)(HEAD PARAMS REAL out[2][16]) { poses(KEEP PASS_PARAMS 2, (REAL *)out); }
void NAME(position)(HEAD PARAMS RESULT(3)) { points(KEEP PASS_PARAMS TIPS, (REAL *)out); }

#else
#if SEVERAL
#define CELLS(width) (REAL (*)[width])
#else
#define CELLS(width)
#endif

#define BATCH(function, cells, frames, width, kept)                                                         \
    void NAME(function##_batch)(size_t n, const REAL *q, ptrdiff_t q_pose, ptrdiff_t q_joint, PARAMS        \
                                REAL *out, ptrdiff_t out_stride, int layout)                                \
    {                                                                                                       \
        for (ptrdiff_t i = 0; i < (ptrdiff_t)n; ++i) {                                                      \
            REAL point[DOF + 1], pose[(frames) * (width)];                                                  \
            ptrdiff_t next = 0;                                                                             \
            for (int j = 0; j < DOF; ++j) point[j] = q[i * q_pose + j * q_joint];                           \
            (void)point;                                                                                    \
            NAME(function)(PASS_Q PASS_PARAMS cells pose);                                                  \
            for (int k = 0; k < (frames) * (width); ++k) {                                                  \
                if (layout == 0) out[i * out_stride + k] = pose[k];                                         \
                else if (k % (width) < (kept) && layout == 1) out[i * out_stride + next++] = pose[k];       \
                else if (k % (width) < (kept)) out[next++ * out_stride + i] = pose[k];                      \
            }                                                                                               \
        }                                                                                                   \
    }

BATCH(fk, CELLS(16), TIPS, 16, 12)
BATCH(frames, (REAL (*)[16]), 2, 16, 12)
BATCH(position, CELLS(3), TIPS, 3, 3)
#endif
