// What the memory itself allows, what a plain C++ loop makes of a cloud, and prototypes: kernels that do only what takes
// the time. Compiled by native.py.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace {

// Eight words, at any address.
typedef std::uint64_t Words __attribute__((vector_size(64), aligned(1), may_alias));
constexpr std::size_t UNROLLED = 4, BLOCK = UNROLLED * sizeof(Words);

typedef float Floats __attribute__((vector_size(64), aligned(4), may_alias));
typedef std::int32_t Integers __attribute__((vector_size(64)));
constexpr std::int32_t LANES = 16, GROUPS = 4, BEAMS = GROUPS * LANES;
constexpr Integers LANE = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

struct Key {
    float key;
    std::int32_t beam;
};

// The smallest lane, in every lane.
template <typename Lanes>
Lanes smallest(Lanes x) {
    for (std::int32_t half = LANES / 2; half > 0; half /= 2) {
        const Lanes other = __builtin_shuffle(x, LANE ^ half);
        x = other < x ? other : x;
    }
    return x;
}

// The range times the inverse of 16 beams; infinite where the range is not within its bounds.
Floats keys(const float* ranges, const float* inverses, float low, float high) {
    const Floats range = *reinterpret_cast<const Floats*>(ranges), inverse = *reinterpret_cast<const Floats*>(inverses);
    return ((range >= low) & (range <= high)) ? range * inverse : Floats{} + std::numeric_limits<float>::infinity();
}

// The least key of a scan. Each lane keeps the least of its own, and in which 64 beams it was; no branch depends on a
// range.
Key least_key(const float* ranges, std::int32_t beams, const float* inverses, float low, float high) {
    Floats least = Floats{} + std::numeric_limits<float>::infinity();
    Integers block{};
    for (std::int32_t at = 0, last = beams - BEAMS;; at += BEAMS) {
        at = std::min(at, last);
        Floats group[GROUPS];
        for (std::int32_t i = 0; i < GROUPS; ++i)
            group[i] = keys(ranges + at + i * LANES, inverses + at + i * LANES, low, high);
        const Floats one = group[0] < group[1] ? group[0] : group[1], two = group[2] < group[3] ? group[2] : group[3];
        const Floats of_block = one < two ? one : two;
        block = of_block < least ? Integers{} + at : block;
        least = of_block < least ? of_block : least;
        if (at == last) break;
    }
    const Floats key = smallest(least);
    const Integers nowhere = Integers{} + beams;
    const std::int32_t first = smallest(least == key ? block : nowhere)[0];
    Integers beam = nowhere;
    for (std::int32_t at = first + BEAMS; (at -= LANES) >= first;)
        beam = keys(ranges + at, inverses + at, low, high) == key ? LANE + at : beam;
    return {key[0], smallest(beam)[0]};
}

#ifdef __AVX512F__
// The median of all pairs' ratios of distances, for AVX-512 and for positions in random order. A sample of the pairs
// gives a bracket; a pass over all pairs counts those below it and notes where others are inside; those are ranked.
// Ratios are squared. What rounding to float32 may change is left undecided.

constexpr std::size_t MOST = 4096, ROOM = MOST * MOST / 32 + MOST;
constexpr double SHIFTS = 2.5, DEVIATIONS = 3.0;

struct Group {
    __m512 x0, y0, x1, y1;
};

// Positions before and now, with NaN behind the last.
alignas(64) float positions[4][MOST + LANES];
// Squared ratios of the sample, and of the pairs inside the bracket.
alignas(64) float ratios[LANES * ROOM];
// Pairs inside: the first match, the first of 16 second matches, and a bit for each of these.
std::uint64_t inside[ROOM];

Group sixteen(std::size_t at) {
    return {_mm512_loadu_ps(positions[0] + at), _mm512_loadu_ps(positions[1] + at), _mm512_loadu_ps(positions[2] + at),
            _mm512_loadu_ps(positions[3] + at)};
}

Group copies(std::size_t i) {
    return {_mm512_set1_ps(positions[0][i]), _mm512_set1_ps(positions[1][i]), _mm512_set1_ps(positions[2][i]),
            _mm512_set1_ps(positions[3][i])};
}

// The squared distances of 16 pairs, before and now.
struct Squares {
    __m512 before, now;

    Squares(const Group& a, const Group& b) {
        const __m512 x0 = b.x0 - a.x0, y0 = b.y0 - a.y0, x1 = b.x1 - a.x1, y1 = b.y1 - a.y1;
        before = _mm512_fmadd_ps(x0, x0, y0 * y0);
        now = _mm512_fmadd_ps(x1, x1, y1 * y1);
    }

    __mmask16 count(__m512 least) const {
        return _mm512_mask_cmp_ps_mask(_mm512_cmp_ps_mask(now, least, _CMP_GE_OQ), before, __m512{}, _CMP_GT_OQ);
    }
};

// Appends the ratios of the pairs whose bit is set.
float* append(float* end, const Squares& pairs, __mmask16 those) {
    _mm512_storeu_ps(end, _mm512_maskz_compress_ps(those, pairs.now / pairs.before));
    return end + __builtin_popcount(those);
}

// The ratio of a rank: its bits are found from the highest on.
float of_rank(float* end, std::size_t rank) {
    _mm512_storeu_ps(end, __m512{} + std::numeric_limits<float>::infinity());
    std::int32_t found = 0;
    for (std::int32_t bit = 1 << 30; bit > 0; bit >>= 1) {
        const __m512i limit = _mm512_set1_epi32(found | bit);
        std::size_t below = 0;
        for (const float* at = ratios; at < end; at += LANES)
            below += __builtin_popcount(_mm512_cmplt_epi32_mask(_mm512_loadu_si512(at), limit));
        if (below <= rank) found |= bit;
    }
    float ratio;
    std::memcpy(&ratio, &found, sizeof ratio);
    return ratio;
}

double median_ratio(const float* before, const float* now, std::size_t count, float least_distance) {
    for (std::size_t i = 0; i < count + LANES; ++i)
        for (std::size_t axis = 0; axis < 2; ++axis) {
            positions[axis][i] = i < count ? before[2 * i + axis] : std::numeric_limits<float>::quiet_NaN();
            positions[2 + axis][i] = i < count ? now[2 * i + axis] : std::numeric_limits<float>::quiet_NaN();
        }
    const __m512 least = _mm512_set1_ps(least_distance * least_distance);
    float* end = ratios;
    const std::size_t shifts = SHIFTS * std::cbrt(count);
    for (std::size_t shift = 0; shift < shifts; ++shift) {
        const std::size_t apart = 1 + (2 * shift + 1) * (count - 2) / (2 * shifts);
        for (std::size_t i = 0; i + apart < count; i += LANES) {
            const Squares pairs(sixteen(i), sixteen(i + apart));
            end = append(end, pairs, pairs.count(least));
        }
    }
    const double sampled = end - ratios, margin = DEVIATIONS * std::sqrt(sampled) / 2;
    const __m512 low = _mm512_set1_ps(of_rank(end, sampled / 2 - margin));
    const __m512 high = _mm512_set1_ps(of_rank(end, sampled / 2 + margin));
    std::size_t pairs = 0, below = 0, noted = 0;
    for (std::size_t i = 0; i + 1 < count; ++i) {
        const Group one = copies(i);
        for (std::size_t j = i + 1; j < count; j += LANES) {
            const Squares squares(one, sixteen(j));
            const __mmask16 counts = squares.count(least);
            const __mmask16 lower = _mm512_mask_cmp_ps_mask(counts, squares.now, low * squares.before, _CMP_LT_OQ);
            const __mmask16 most = _mm512_mask_cmp_ps_mask(counts, squares.now, high * squares.before, _CMP_LE_OQ);
            pairs += __builtin_popcount(counts);
            below += __builtin_popcount(lower);
            inside[noted] = i << 40 | j << 16 | (most & ~lower);
            noted += most != lower;
        }
    }
    end = ratios;
    for (std::size_t at = 0; at < noted; ++at) {
        const std::size_t i = inside[at] >> 40, j = inside[at] >> 16 & 0xffffff;
        end = append(end, Squares(copies(i), sixteen(j)), inside[at] & 0xffff);
    }
    const float lower = of_rank(end, (pairs - 1) / 2 - below), upper = of_rank(end, pairs / 2 - below);
    return (std::sqrt(double(lower)) + std::sqrt(double(upper))) / 2;
}
#endif

}  // namespace

extern "C" {

// The least key of each of some scans of at least 64 beams, again and again: what `.min` computes without offsets,
// without rules for readings, and in float32 only.
void least_keys(const float* ranges, std::size_t scans, std::int32_t beams, const float* inverses, float low, float high,
                std::size_t rounds, Key* out) {
    for (std::size_t round = 0; round < rounds; ++round)
        for (std::size_t scan = 0; scan < scans; ++scan)
            out[scan] = least_key(ranges + scan * beams, beams, inverses, low, high);
}

#ifdef __AVX512F__
// The median ratio of each of some pictures, again and again: `count` positions before, and as many now.
void median_ratios(const float* matches, std::size_t pictures, std::size_t count, float least, std::size_t rounds,
                   double* out) {
    for (std::size_t round = 0; round < rounds; ++round)
        for (std::size_t picture = 0; picture < pictures; ++picture) {
            const float* before = matches + 4 * count * picture;
            out[picture] = median_ratio(before, before + 2 * count, count, least);
        }
}
#endif

// The bitwise or of all bytes: every byte is read, and next to nothing is done with it.
std::uint8_t bare_read(const std::uint8_t* bytes, std::size_t count) {
    Words any[UNROLLED] = {};
    std::size_t i = 0;
    for (; i + BLOCK <= count; i += BLOCK)
        for (std::size_t j = 0; j < UNROLLED; ++j) any[j] |= reinterpret_cast<const Words*>(bytes + i)[j];
    std::uint8_t folded[BLOCK], result = 0;
    std::memcpy(folded, any, BLOCK);
    for (std::uint8_t byte : folded) result |= byte;
    for (; i < count; ++i) result |= bytes[i];
    return result;
}

// Reads as many bytes as it writes; unlike memcpy, never past the caches.
void copy(const std::uint8_t* from, std::uint8_t* to, std::size_t count) {
    std::size_t i = 0;
    for (; i + BLOCK <= count; i += BLOCK)
        for (std::size_t j = 0; j < UNROLLED; ++j)
            reinterpret_cast<Words*>(to + i)[j] = reinterpret_cast<const Words*>(from + i)[j];
    for (; i < count; ++i) to[i] = from[i];
}

// The k-th smallest x among the rows of x, y, z, intensity whose every number is within its bounds, low and high.
float kth_smallest(const float* rows, std::size_t count, std::size_t k, const float* bounds) {
    static std::vector<float> inside;
    inside.clear();
    for (const float* row = rows; row != rows + 4 * count; row += 4) {
        if (row[0] >= bounds[0] && row[0] <= bounds[1] && row[1] >= bounds[2] && row[1] <= bounds[3] &&
            row[2] >= bounds[4] && row[2] <= bounds[5] && row[3] >= bounds[6] && row[3] <= bounds[7])
            inside.push_back(row[0]);
    }
    if (inside.size() < k) return std::numeric_limits<float>::quiet_NaN();
    std::nth_element(inside.begin(), inside.begin() + (k - 1), inside.end());
    return inside[k - 1];
}
}
