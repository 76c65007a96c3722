// What the memory itself allows, and what a plain C++ loop makes of a cloud. Compiled by native.py.

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

}  // namespace

extern "C" {

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
