#include "core/io/npz.h"

#include <set>

#include "core/atomic_file.h"
#include "core/io/npy.h"
#include "core/io/zip_archive.h"

namespace atelier {
namespace {

constexpr std::string_view kSuffix = ".npy";

std::string without_suffix(std::string name) {
  if (name.ends_with(kSuffix)) {
    name.resize(name.size() - kSuffix.size());
  }
  return name;
}

}  // namespace

struct Npz::State {
  ZipArchive archive;
  Limits limits;
  std::vector<std::string> names;                             ///< of the arrays
  std::map<std::string, std::string, std::less<>> members{};  ///< by array

  State(ZipArchive zip, const Limits& ceilings) : archive(std::move(zip)), limits(ceilings) {
    for (const std::string& member : archive.names()) {
      names.push_back(without_suffix(member));
      if (!members.emplace(names.back(), member).second) {
        throw DataError(archive.file(), "member " + names.back(), "two members of this name",
                        "one");
      }
    }
  }
};

Npz::Npz(const std::filesystem::path& path, const Limits& limits)
    : state_(std::make_unique<State>(ZipArchive(path, limits), limits)) {}

Npz::Npz(std::vector<std::byte> bytes, std::string name, const Limits& limits)
    : state_(
          std::make_unique<State>(ZipArchive(std::move(bytes), std::move(name), limits), limits)) {}

Npz::~Npz() = default;
Npz::Npz(Npz&&) noexcept = default;
Npz& Npz::operator=(Npz&&) noexcept = default;

const std::vector<std::string>& Npz::names() const {
  return state_->names;
}

bool Npz::contains(std::string_view name) const {
  return state_->members.find(name) != state_->members.end();
}

const std::string& Npz::file() const {
  return state_->archive.file();
}

Tensor Npz::read(std::string_view name) const {
  const auto found = state_->members.find(name);
  if (found == state_->members.end()) {
    std::string known;
    for (const std::string& other : state_->names) {
      known += (known.empty() ? "" : ", ") + other;
      if (known.size() > 200) {
        known += ", ...";
        break;
      }
    }
    throw DataError(file(), "", "no array \"" + std::string(name) + "\"", "one of: " + known);
  }
  return parse_npy(state_->archive.read(found->second, state_->limits.tensor_bytes),
                   file() + ": " + found->first, state_->limits);
}

std::vector<std::byte> npz_bytes(const std::map<std::string, Tensor>& arrays, bool deflate) {
  std::vector<std::pair<std::string, std::vector<std::byte>>> members;
  members.reserve(arrays.size());
  for (const auto& [name, tensor] : arrays) {
    ATELIER_CHECK(!name.empty(), "an array needs a name");
    members.emplace_back(name + std::string(kSuffix), npy_bytes(tensor));
  }
  return zip_bytes(members, deflate);
}

void write_npz(const std::filesystem::path& path, const std::map<std::string, Tensor>& arrays,
               bool deflate) {
  AtomicFile file(path);
  file.write(npz_bytes(arrays, deflate));
  file.commit();
}

}  // namespace atelier
