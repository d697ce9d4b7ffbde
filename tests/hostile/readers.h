#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <span>
#include <string>
#include <vector>

namespace atelier::fixtures {

using Bytes = std::vector<std::byte>;

/// One reader of foreign bytes, as its fuzz target fuzz/<name>_fuzz.cpp calls it: it returns, or
/// throws DataError.
struct Reader {
  std::string name;
  void (*read)(std::span<const std::byte> bytes);
};

inline void PrintTo(const Reader& reader, std::ostream* out) {
  *out << reader.name;
}

/// Every fuzz target of the program.
std::vector<Reader> all_readers();

/// fuzz/corpus/<reader>/*, sorted by name.
std::vector<std::filesystem::path> corpus_of(const Reader& reader);

/// The file of the corpus whose every truncation and every flipped bit is tried: small.*, at most
/// 4 KB.
std::filesystem::path small_file_of(const Reader& reader);

/// Every `stride`-th of the truncations and flipped bits is tried. 1 with ATELIER_SOAK=1 and for
/// most readers; larger for those that start a process for each file, and for all but one of a
/// format.
std::size_t stride_of(const Reader& reader);

/// How many mutated files of its corpus are tried: thousands, but where each starts a process.
std::size_t mutations_of(const Reader& reader);

/// In how many places, evenly over a reader's work, memory runs out; at most as many as there are.
std::size_t places_of(const Reader& reader);

/// One hand-made malformed file: a line of tests/hostile/malformed/<reader>/index.txt,
///   file | what is wrong | words the error must contain
struct MalformedFile {
  std::string reader;
  std::filesystem::path path;
  std::string wrong;
  std::string words;
};

inline void PrintTo(const MalformedFile& file, std::ostream* out) {
  *out << file.reader << "/" << file.path.filename().string() << " (" << file.wrong << ")";
}

/// Every line of every index.
std::vector<MalformedFile> all_malformed_files();

/// The bytes of a file of the source tree.
Bytes bytes_of(const std::filesystem::path& path);

/// Bytes `copies` of which are changed at random places: flipped, overwritten by a number that is
/// often wrong (0, -1, 2^31, ...), cut out, doubled, or cut off. Depends on `bytes` and `number`
/// alone.
Bytes mutated(const Bytes& bytes, std::uint64_t number);

}  // namespace atelier::fixtures
