#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// What tells an input again after it was moved and has grown, lost files or was changed in part:
/// the smallest of the numbers that begin the digests of its files, each once, increasing; all of
/// them where there are few. Names do not count. A MinHash sketch (Broder, "On the resemblance and
/// containment of documents", 1997).
using ContentSketch = std::vector<std::uint64_t>;

/// Numbers in a sketch at most.
inline constexpr std::size_t kSketchSize = 256;

/// The sketch of files whose digests begin with these numbers.
ContentSketch content_sketch(std::vector<std::uint64_t> files);

/// How many files of one input are in another, of those that two sketches can tell of: a sample
/// that chance takes, and the smaller the larger the other is. None where one has no sketch.
struct SharedFiles {
  std::size_t shared = 0;
  std::size_t compared = 0;
};
SharedFiles shared_files(const ContentSketch& of, const ContentSketch& in);

/// Whether at least three quarters of the files of one are in the other. Captures of one rig share
/// calibrations, backgrounds and empty masks, which are fewer.
bool holds_mostly(const ContentSketch& of, const ContentSketch& in);

/// 16 lower-case hexadecimal digits for each number.
std::string sketch_text(const ContentSketch& sketch);

/// Reads what `sketch_text` writes. Returns false for any other text.
bool parse_sketch(std::string_view text, ContentSketch& sketch);

}  // namespace atelier
