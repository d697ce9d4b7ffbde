#include "tests/hostile/readers.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>

#include "core/random.h"
#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

const std::filesystem::path kSource = source_directory();

/// Readers that start a process per file.
const std::set<std::string> kInProcesses = {"foreign_hdf5", "fbx"};

/// Readers of a format whose every bit another reader is given: "archive", "safetensors", "gltf".
const std::set<std::string> kOfOneFormat = {"garment",
                                            "truth",
                                            "tracked_motion",
                                            "appearance_data",
                                            "appearance_colors",
                                            "painted_scene",
                                            "painted_picture",
                                            "body_archive",
                                            "personal_body",
                                            "appearance_model",
                                            "smpl",
                                            "gltf_body",
                                            "simulated_frame",
                                            "animated_frame",
                                            "synthesis_state",
                                            "sequence_header",
                                            "training",
                                            "mesh_sequence",
                                            "dna"};

bool soaking() {
  const char* soak = std::getenv("ATELIER_SOAK");
  return soak != nullptr && std::string(soak) == "1";
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  const std::size_t end = text.find_last_not_of(" \t");
  return begin == std::string::npos ? "" : text.substr(begin, end - begin + 1);
}

std::uint64_t pick(Random& random, std::uint64_t n) {
  const RandomWords words = random_words(random.seed, random.stream, random.counter++);
  return (static_cast<std::uint64_t>(words.word[0]) << 32 | words.word[1]) % n;
}

}  // namespace

std::vector<std::filesystem::path> corpus_of(const Reader& reader) {
  std::vector<std::filesystem::path> files;
  const std::filesystem::path folder = kSource / "fuzz" / "corpus" / reader.name;
  if (std::filesystem::is_directory(folder)) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::filesystem::path small_file_of(const Reader& reader) {
  for (const std::filesystem::path& path : corpus_of(reader)) {
    if (path.stem() == "small") {
      return path;
    }
  }
  throw std::runtime_error("no fuzz/corpus/" + reader.name + "/small.*");
}

std::size_t stride_of(const Reader& reader) {
  return soaking()                            ? 1
         : kInProcesses.contains(reader.name) ? 97
         : kOfOneFormat.contains(reader.name) ? 5
                                              : 1;
}

std::size_t mutations_of(const Reader& reader) {
  return kInProcesses.contains(reader.name) && !soaking() ? 41 : 4'000;
}

std::size_t places_of(const Reader& reader) {
  return soaking() ? 1'000'000 : kInProcesses.contains(reader.name) ? 7 : 61;
}

std::vector<MalformedFile> all_malformed_files() {
  std::vector<MalformedFile> files;
  const std::filesystem::path root = kSource / "tests" / "hostile" / "malformed";
  std::vector<std::filesystem::path> folders;
  for (const auto& entry : std::filesystem::directory_iterator(root)) {
    folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  const std::vector<Reader> readers = all_readers();
  for (const std::filesystem::path& folder : folders) {
    const bool known = std::any_of(readers.begin(), readers.end(), [&](const Reader& reader) {
      return folder.filename() == reader.name;
    });
    if (!known && folder.filename() == "fbx") {
      continue;  // a build without libassimp
    }
    std::ifstream index(folder / "index.txt");
    for (std::string line; std::getline(index, line);) {
      if (trimmed(line).empty() || line[0] == '#') {
        continue;
      }
      const std::size_t first = line.find('|');
      const std::size_t second = line.find('|', first + 1);
      if (second == std::string::npos) {
        throw std::runtime_error(folder.string() +
                                 "/index.txt: no \"file | wrong | words\": " + line);
      }
      files.push_back({folder.filename().string(), folder / trimmed(line.substr(0, first)),
                       trimmed(line.substr(first + 1, second - first - 1)),
                       trimmed(line.substr(second + 1))});
    }
  }
  return files;
}

Bytes bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw std::runtime_error("cannot open " + path.string());
  }
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

Bytes mutated(const Bytes& bytes, std::uint64_t number) {
  static constexpr std::uint64_t kWrong[] = {0,
                                             1,
                                             0x7F,
                                             0x80,
                                             0xFF,
                                             0x7FFF,
                                             0xFFFF,
                                             0x7FFFFFFF,
                                             0x80000000,
                                             0xFFFFFFFF,
                                             0x7FFFFFFFFFFFFFFF,
                                             0x8000000000000000,
                                             0xFFFFFFFFFFFFFFFF,
                                             0x7FC00000,
                                             0x7FF8000000000000};
  Bytes result = bytes;
  Random random{0x48057113, number, 0};
  const std::uint64_t edits = 1 + pick(random, 4);
  for (std::uint64_t edit = 0; edit < edits && !result.empty(); ++edit) {
    const std::size_t at = pick(random, result.size());
    const std::size_t length = std::min<std::size_t>(1 + pick(random, 32), result.size() - at);
    const auto place = result.begin() + static_cast<std::ptrdiff_t>(at);
    switch (pick(random, 6)) {
      case 0:
        result[at] ^= static_cast<std::byte>(1u << pick(random, 8));
        break;
      case 1:
        result[at] = static_cast<std::byte>(pick(random, 256));
        break;
      case 2: {
        const std::uint64_t wrong = kWrong[pick(random, std::size(kWrong))];
        std::memcpy(&result[at], &wrong,
                    std::min<std::size_t>(std::size_t{1} << pick(random, 4), result.size() - at));
        break;
      }
      case 3:
        result.erase(place, place + static_cast<std::ptrdiff_t>(length));
        break;
      case 4: {
        const Bytes copy(place, place + static_cast<std::ptrdiff_t>(length));
        const auto target = static_cast<std::ptrdiff_t>(pick(random, result.size() + 1));
        result.insert(result.begin() + target, copy.begin(), copy.end());
        break;
      }
      default:
        if (pick(random, 4) == 0) {
          result.resize(at);
        } else {
          result[at] = result[pick(random, result.size())];
        }
    }
  }
  return result;
}

}  // namespace atelier::fixtures
