/* The amplitudes of a frame as one would write them in C: Eqs. 9 to 11 with the deformation gradient, in floats.
   All that does not depend on the deformed surface is given: see bench_amplitude.py. */

#include <math.h>

void displace(int triangles, const int *sides, const float *products, const float *tensors, /* of the base mesh */
              int vertices, const int *shares, const int *of, const float *share,           /* its vertices */
              int points, const int *corners, const float *barycentric,                     /* of the refined mesh */
              const int *entries, const float *squares, const float *height, const float *steep,
              const float *base, const float *bare, const float *smooth, float *strain, float *metric, float *out)
{
  for (int t = 0; t < triangles; t++) {
    const float *p = base + 3 * sides[3 * t], *q = base + 3 * sides[3 * t + 1], *r = base + 3 * sides[3 * t + 2];
    float aa = 0.0f, bb = 0.0f, ab = 0.0f;
    for (int k = 0; k < 3; k++) {
      float a = q[k] - p[k], b = r[k] - p[k];
      aa += a * a;
      bb += b * b;
      ab += a * b;
    }
    aa -= products[3 * t];
    bb -= products[3 * t + 1];
    ab -= products[3 * t + 2];
    const float *m = tensors + 18 * t;
    for (int k = 0; k < 6; k++)
      strain[6 * t + k] = aa * m[k] + bb * m[6 + k] + ab * m[12 + k];
  }
  for (int v = 0; v < vertices; v++) {
    float sum[6] = {0.0f};
    for (int e = shares[v]; e < shares[v + 1]; e++)
      for (int k = 0; k < 6; k++)
        sum[k] += share[e] * strain[6 * of[e] + k];
    for (int k = 0; k < 6; k++)
      metric[6 * v + k] = sum[k];
  }
  for (int i = 0; i < points; i++) {
    float rise = 0.0f, asked = 0.0f;
    if (entries[i] < entries[i + 1]) {
      float here[6];
      const float *a = metric + 6 * corners[3 * i], *b = metric + 6 * corners[3 * i + 1],
                  *c = metric + 6 * corners[3 * i + 2], *w = barycentric + 3 * i;
      for (int k = 0; k < 6; k++)
        here[k] = w[0] * a[k] + w[1] * b[k] + w[2] * c[k];
      for (int e = entries[i]; e < entries[i + 1]; e++) {
        float change = 1.0f;
        for (int k = 0; k < 6; k++)
          change += squares[6 * e + k] * here[k];
        float epsilon = 1.0f - sqrtf(change > 0.0f ? change : 0.0f);
        if (epsilon <= 0.0f)
          continue;
        float sine = sinf(1.57079633f * (epsilon < 1.0f ? epsilon : 1.0f));
        rise += height[e] * sine;
        asked += steep[e] * sine / sqrtf(epsilon);
      }
    }
    rise /= asked > 1.0f ? asked : 1.0f;
    for (int k = 0; k < 3; k++)
      out[3 * i + k] = bare[3 * i + k] + rise * smooth[3 * i + k];
  }
}
