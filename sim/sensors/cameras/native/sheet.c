/* One row of a textured plane: bilinear samples at 1/256 of a texture pixel, in whole numbers. */

/* A sample lies so far within the texture that rounding does not take it out [texture px]. */
static const double INSIDE = 1.0 / 64.0;
/* What the rows below will read is fetched so many texture rows early. */
enum { AHEAD = 3 };
/* Added before a number is cut to a whole one, so that this rounds to the nearest below zero too. */
static const float LIFT = 1048576.0f;

/* Where each pixel reads: byte offset of the upper left sample, and its place in 256ths of a texture pixel. */
static void places(const double *back, double v, int64_t low, int64_t high, int64_t rows, int64_t columns,
                   int32_t *restrict at, int32_t *restrict across, int32_t *restrict down)
{
    const double x1 = back[0], y1 = back[3], w1 = back[6], start = (double)low;
    const double w0 = w1 * start + (back[7] * v + back[8]);
    const double x0 = (x1 * start + (back[1] * v + back[2])) / w0, y0 = (y1 * start + (back[4] * v + back[5])) / w0;
    /* x(u) = x0 + (x1 - x0 w1) t with t = (u - start) / w(u): small numbers, for which single precision will do */
    const double whole_x = floor(x0 * 256.0), whole_y = floor(y0 * 256.0);
    const float rest_x = (float)(x0 * 256.0 - whole_x) + (LIFT + 0.5f), along_x = (float)(256.0 * (x1 - x0 * w1));
    const float rest_y = (float)(y0 * 256.0 - whole_y) + (LIFT + 0.5f), along_y = (float)(256.0 * (y1 - y0 * w1));
    const float w_start = (float)w0, w_step = (float)w1;
    const int32_t base_x = (int32_t)whole_x - (int32_t)LIFT, base_y = (int32_t)whole_y - (int32_t)LIFT;
    const int32_t row = 4 * (int32_t)columns, count = (int32_t)(high - low);
    const int32_t most_x = 256 * (int32_t)(columns - 1) - 1, most_y = 256 * (int32_t)(rows - 1) - 1;
    for (int32_t i = 0; i < count; i++) {
        const float t = (float)i / (w_start + w_step * (float)i);
        int32_t x = base_x + (int32_t)(along_x * t + rest_x), y = base_y + (int32_t)(along_y * t + rest_y);
        x = x < 0 ? 0 : x > most_x ? most_x : x;
        y = y < 0 ? 0 : y > most_y ? most_y : y;
        at[i] = (y >> 8) * row + (x >> 8) * 4;
        across[i] = x;
        down[i] = y;
    }
}

#ifdef __AVX2__
/* Two neighbours of each of two pixels, as numbers of 16 bits. */
static inline __m256i neighbours(const uint8_t *one, const uint8_t *other)
{
    const __m128i low = _mm_loadl_epi64((const __m128i *)one);
    return _mm256_cvtepu8_epi16(_mm_castpd_si128(_mm_loadh_pd(_mm_castsi128_pd(low), (const double *)other)));
}

/* The lowest byte of two numbers, eight times each, as numbers of 16 bits. */
static inline __m256i spread(const int32_t *two)
{
    const __m256i one = _mm256_set1_epi16((short)0x8000), other = _mm256_set1_epi16((short)0x8004);
    int64_t both;
    memcpy(&both, two, 8);
    return _mm256_shuffle_epi8(_mm256_set1_epi64x(both), _mm256_permute2x128_si256(one, other, 0x20));
}

/* Two pixels: the left and the right neighbours' parts, times 128. */
static inline __m256i halves(const uint8_t *texture, int64_t stride, const int32_t *at, const int32_t *across,
                             const int32_t *down)
{
    const uint8_t *one = texture + at[0], *other = texture + at[1];
    const __m256i upper = neighbours(one, other), lower = neighbours(one + stride, other + stride);
    const __m256i part = _mm256_slli_epi16(spread(across), 7), left = _mm256_set_epi64x(0, -1, 0, -1);
    const __m256i weights = _mm256_add_epi16(_mm256_xor_si256(part, left), /* left: 32768 - part */
                                             _mm256_and_si256(left, _mm256_set1_epi16((short)32769)));
    const __m256i change = _mm256_mullo_epi16(_mm256_sub_epi16(lower, upper), spread(down));
    return _mm256_mulhi_epu16(_mm256_add_epi16(_mm256_slli_epi16(upper, 8), change), weights);
}

/* Pixels of three channels at those places; up to 13 bytes more than asked for are written. */
static void sample(const uint8_t *texture, int64_t stride, const int32_t *at, const int32_t *across,
                   const int32_t *down, int64_t count, uint8_t *out)
{
    const __m128i three = _mm_set_epi8(-1, -1, -1, -1, 14, 13, 12, 6, 5, 4, 10, 9, 8, 2, 1, 0);
    for (int64_t i = 0; i < count; i += 4) {
        _mm_prefetch((const char *)texture + at[i] + AHEAD * stride, _MM_HINT_T0);
        const __m256i a = halves(texture, stride, at + i, across + i, down + i);
        const __m256i b = halves(texture, stride, at + i + 2, across + i + 2, down + i + 2);
        const __m256i sum = _mm256_add_epi16(_mm256_unpacklo_epi64(a, b), _mm256_unpackhi_epi64(a, b));
        const __m256i value = _mm256_srli_epi16(_mm256_add_epi16(sum, _mm256_set1_epi16(65)), 7); /* 0, 2 | 1, 3 */
        const __m128i pixels = _mm_packus_epi16(_mm256_castsi256_si128(value), _mm256_extracti128_si256(value, 1));
        _mm_storeu_si128((__m128i *)(out + 3 * i), _mm_shuffle_epi8(pixels, three));
    }
}
#else
/* The same bits without wide registers. */
static void sample(const uint8_t *texture, int64_t stride, const int32_t *at, const int32_t *across,
                   const int32_t *down, int64_t count, uint8_t *out)
{
    for (int64_t i = 0; i < count; i++) {
        const uint8_t *from = texture + at[i];
        const uint32_t right_weight = 128u * (across[i] & 255), left_weight = 32768u - right_weight;
        const int32_t fall = down[i] & 255;
        for (int64_t c = 0; c < 3; c++) {
            const uint32_t left = (uint32_t)(from[c] * 256 + (from[stride + c] - from[c]) * fall);
            const uint32_t right = (uint32_t)(from[c + 4] * 256 + (from[stride + c + 4] - from[c + 4]) * fall);
            out[3 * i + c] = (uint8_t)(((left * left_weight >> 16) + (right * right_weight >> 16) + 65) >> 7);
        }
    }
}
#endif

/* Columns [low, high) of a row of the picture, with a plain colour where the texture ends. */
static void sheet_row(const struct camera *camera, const struct sheet *sheet, const uint8_t *texture, int64_t rows,
                      int64_t columns, double v, int64_t low, int64_t high, uint8_t *out)
{
    if (low >= high)
        return;
    const double *m = sheet->back;
    const double x0 = m[1] * v + m[2], y0 = m[4] * v + m[5], w0 = m[7] * v + m[8];
    const double right = (double)(columns - 1) - INSIDE, bottom = (double)(rows - 1) - INSIDE;
    int64_t first = low, end = high;
    narrow(m[6], w0 - 1e-6, &first, &end);
    narrow(m[0], x0, &first, &end);
    narrow(m[3], y0, &first, &end);
    narrow(right * m[6] - m[0], right * w0 - x0, &first, &end);
    narrow(bottom * m[6] - m[3], bottom * w0 - y0, &first, &end);
    if (first < end) {
        const int64_t room = camera->columns + SPARE;
        int32_t *at = (int32_t *)camera->scratch;
        int32_t *across = at + room, *down = across + room;
        places(m, v, first, end, rows, columns, at, across, down);
        for (int64_t i = end - first; i < end - first + 3; i++) /* as many are sampled at once */
            at[i] = at[end - first - 1], across[i] = across[end - first - 1], down[i] = down[end - first - 1];
        sample(texture, 4 * columns, at, across, down, end - first, out + 3 * first);
    }
    for (int64_t u = low; u < first; u++)
        memcpy(out + 3 * u, camera->plain, 3);
    for (int64_t u = end; u < high; u++)
        memcpy(out + 3 * u, camera->plain, 3);
}
