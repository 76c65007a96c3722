// What the memory itself allows, what a plain C++ loop makes of a cloud, and prototypes: kernels that do only what takes
// the time. Compiled by native.py.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

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
