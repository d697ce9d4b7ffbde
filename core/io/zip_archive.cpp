#include "core/io/zip_archive.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include <zip.h>

#include "core/error.h"
#include "core/regular_file.h"

namespace atelier {
namespace {

std::string reason_of(zip_error_t* error) {
  std::string text = zip_error_strerror(error);
  zip_error_fini(error);
  return text;
}

struct Close {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
  void operator()(zip_t* archive) const { zip_discard(archive); }
};

}  // namespace

struct ZipArchive::State {
  std::string file;
  Limits limits;
  std::int64_t file_bytes = 0;
  std::vector<std::byte> bytes;  ///< of a file in memory; outlives `archive`
  std::unique_ptr<zip_t, Close> archive;
  std::vector<std::string> names;
  std::map<std::string, zip_uint64_t, std::less<>> index;

  void open(zip_source_t* source);
  /// A member that was judged by what the zip says of it, and how many bytes it says.
  std::pair<std::unique_ptr<zip_file_t, Close>, std::int64_t> opened(zip_uint64_t member,
                                                                     const std::string& name,
                                                                     std::int64_t max_bytes) const;
  std::vector<std::byte> inflate(zip_uint64_t member, const std::string& name,
                                 std::int64_t max_bytes) const;
  /// @param max_bytes  that are left to it
  /// @return  its bytes
  std::int64_t check(zip_uint64_t member, const std::string& name, std::int64_t max_bytes) const;
  [[noreturn]] void fail(const std::string& name, const std::string& found,
                         const std::string& expected) const {
    throw DataError(file, name.empty() ? "" : "member " + name, found, expected);
  }
};

void ZipArchive::State::open(zip_source_t* source) {
  zip_error_t error;
  zip_error_init(&error);
  archive.reset(zip_open_from_source(source, ZIP_RDONLY, &error));
  if (!archive) {
    zip_source_free(source);
    fail("", "no readable zip: " + reason_of(&error), "a zip");
  }
  zip_error_fini(&error);
  const zip_int64_t count = zip_get_num_entries(archive.get(), 0);
  if (count > limits.archive_entries) {
    fail("", std::to_string(count) + " members",
         "at most " + std::to_string(limits.archive_entries));
  }
  for (zip_int64_t i = 0; i < count; ++i) {
    const auto member = static_cast<zip_uint64_t>(i);
    const char* raw = zip_get_name(archive.get(), member, ZIP_FL_ENC_RAW);
    if (raw == nullptr) {
      fail("", "member " + std::to_string(i) + " without a name", "a name");
    }
    const std::string name = raw;
    if (!index.emplace(name, member).second) {
      fail(name, "two members of this name", "one");
    }
    names.push_back(name);
  }
}

std::pair<std::unique_ptr<zip_file_t, Close>, std::int64_t> ZipArchive::State::opened(
    zip_uint64_t member, const std::string& name, std::int64_t max_bytes) const {
  zip_stat_t status;
  zip_stat_init(&status);
  if (zip_stat_index(archive.get(), member, 0, &status) != 0) {
    fail(name, zip_strerror(archive.get()), "a readable member");
  }
  constexpr zip_uint64_t kNeeded =
      ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_COMP_METHOD | ZIP_STAT_ENCRYPTION_METHOD;
  if ((status.valid & kNeeded) != kNeeded) {
    fail(name, "no sizes", "sizes and method");
  }
  if (status.encryption_method != ZIP_EM_NONE) {
    fail(name, "an encrypted member", "no encryption");
  }
  if (status.comp_method != ZIP_CM_STORE && status.comp_method != ZIP_CM_DEFLATE) {
    fail(name, "compression method " + std::to_string(status.comp_method), "stored or deflated");
  }
  const auto declared = static_cast<std::int64_t>(status.size);
  const auto stored = static_cast<std::int64_t>(status.comp_size);
  if (declared < 0 || stored < 0 || declared > max_bytes) {
    fail(name, std::to_string(status.size) + " bytes", "at most " + std::to_string(max_bytes));
  }
  if (stored > file_bytes) {
    fail(name, std::to_string(stored) + " stored bytes in a file of " + std::to_string(file_bytes),
         "fewer");
  }
  if (declared > limits.inflate_free_bytes && declared / limits.inflate_ratio > stored) {
    fail(name, std::to_string(declared) + " bytes out of " + std::to_string(stored),
         "at most " + std::to_string(limits.inflate_ratio) + " times the stored bytes");
  }
  std::unique_ptr<zip_file_t, Close> source(zip_fopen_index(archive.get(), member, 0));
  if (!source) {
    fail(name, zip_strerror(archive.get()), "a readable member");
  }
  return {std::move(source), declared};
}

std::int64_t ZipArchive::State::check(zip_uint64_t member, const std::string& name,
                                      std::int64_t max_bytes) const {
  const auto [source, declared] = opened(member, name, std::numeric_limits<std::int64_t>::max());
  if (declared > max_bytes) {
    fail(name, std::to_string(declared) + " bytes, which others before it leave no room for",
         "at most " + std::to_string(limits.inflate_ratio) + " times the file's bytes in all");
  }
  std::vector<std::byte> piece(std::size_t{64} << 10);
  std::int64_t done = 0;
  // To where nothing more comes: there the checksum is compared.
  for (zip_int64_t count = 1; count > 0; done += count) {
    count = zip_fread(source.get(), piece.data(), piece.size());
    if (count < 0) {
      fail(name, zip_file_strerror(source.get()), "an undamaged member");
    }
    if (count > declared - done) {
      fail(name, "more bytes than the " + std::to_string(declared) + " declared", "as many");
    }
  }
  if (done != declared) {
    fail(name, std::to_string(done) + " bytes", std::to_string(declared) + ", as declared");
  }
  return declared;
}

std::vector<std::byte> ZipArchive::State::inflate(zip_uint64_t member, const std::string& name,
                                                  std::int64_t max_bytes) const {
  const auto [source, declared] = opened(member, name, max_bytes);
  std::vector<std::byte> content(static_cast<std::size_t>(declared));
  std::size_t filled = 0;
  // One byte more is asked for: only at the end of the member the checksum is compared.
  std::byte beyond{};
  for (;;) {
    const bool full = filled == content.size();
    const zip_int64_t count = zip_fread(source.get(), full ? &beyond : content.data() + filled,
                                        full ? 1 : content.size() - filled);
    if (count < 0) {
      fail(name, zip_file_strerror(source.get()), "an undamaged member");
    }
    if (count == 0) {
      break;
    }
    if (full) {
      fail(name, "more bytes than the " + std::to_string(declared) + " declared", "as many");
    }
    filled += static_cast<std::size_t>(count);
  }
  if (filled != content.size()) {
    fail(name, std::to_string(filled) + " bytes", std::to_string(declared) + ", as declared");
  }
  return content;
}

ZipArchive::ZipArchive(const std::filesystem::path& path, const Limits& limits)
    : state_(std::make_unique<State>()) {
  state_->file = path.string();
  state_->limits = limits;
  state_->file_bytes = RegularFile(path).size();
  if (state_->file_bytes == 0) {
    state_->fail("", "a file of no bytes", "a zip");  // libzip takes it for an empty zip
  }
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_file_create(path.c_str(), 0, -1, &error);
  if (source == nullptr) {
    state_->fail("", reason_of(&error), "a zip");
  }
  zip_error_fini(&error);
  state_->open(source);
}

ZipArchive::ZipArchive(std::vector<std::byte> bytes, std::string name, const Limits& limits)
    : state_(std::make_unique<State>()) {
  state_->file = std::move(name);
  state_->limits = limits;
  state_->bytes = std::move(bytes);
  state_->file_bytes = static_cast<std::int64_t>(state_->bytes.size());
  if (state_->bytes.empty()) {
    state_->fail("", "a file of no bytes", "a zip");
  }
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source =
      zip_source_buffer_create(state_->bytes.data(), state_->bytes.size(), 0, &error);
  if (source == nullptr) {
    state_->fail("", reason_of(&error), "a zip");
  }
  zip_error_fini(&error);
  state_->open(source);
}

ZipArchive::~ZipArchive() = default;
ZipArchive::ZipArchive(ZipArchive&&) noexcept = default;
ZipArchive& ZipArchive::operator=(ZipArchive&&) noexcept = default;

const std::vector<std::string>& ZipArchive::names() const {
  return state_->names;
}

bool ZipArchive::contains(std::string_view name) const {
  return state_->index.find(name) != state_->index.end();
}

std::vector<std::string> ZipArchive::symbolic_links() const {
  constexpr zip_uint32_t kKind = 0170000;  // of a file's mode, as stat(2) has it
  constexpr zip_uint32_t kLink = 0120000;
  std::vector<std::string> links;
  for (const std::string& name : state_->names) {
    // The mode stands above the attributes of DOS; programs on other systems leave it 0.
    zip_uint8_t system = 0;
    zip_uint32_t attributes = 0;
    if (zip_file_get_external_attributes(state_->archive.get(), state_->index.at(name), 0, &system,
                                         &attributes) == 0 &&
        ((attributes >> 16) & kKind) == kLink) {
      links.push_back(name);
    }
  }
  return links;
}

const std::string& ZipArchive::file() const {
  return state_->file;
}

std::vector<std::byte> ZipArchive::read(std::string_view name, std::int64_t max_bytes) const {
  const auto found = state_->index.find(name);
  if (found == state_->index.end()) {
    std::string known;
    for (const std::string& other : state_->names) {
      known += (known.empty() ? "" : ", ") + other;
      if (known.size() > 200) {
        known += ", ...";
        break;
      }
    }
    state_->fail("", "no member \"" + std::string(name) + "\"", "one of: " + known);
  }
  return state_->inflate(found->second, found->first, max_bytes);
}

void ZipArchive::check() const {
  // Members may share their bytes in the file: the ratio of one alone would let it be inflated
  // thousands of times.
  const Limits& limits = state_->limits;
  std::int64_t left =
      std::max(limits.inflate_free_bytes, limits.inflate_ratio * state_->file_bytes);
  for (const auto& [name, member] : state_->index) {
    left -= state_->check(member, name, left);
  }
}

std::vector<std::byte> zip_bytes(
    const std::vector<std::pair<std::string, std::vector<std::byte>>>& members, bool deflate) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* target = zip_source_buffer_create(nullptr, 0, 0, &error);
  if (target == nullptr) {
    throw EnvironmentError("zip", reason_of(&error));
  }
  zip_source_keep(target);
  const std::unique_ptr<zip_source_t, decltype(&zip_source_free)> kept(target, zip_source_free);
  std::unique_ptr<zip_t, Close> archive(zip_open_from_source(target, ZIP_TRUNCATE, &error));
  if (!archive) {
    zip_source_free(target);
    throw EnvironmentError("zip", reason_of(&error));
  }
  zip_error_fini(&error);
  for (const auto& [name, content] : members) {
    ATELIER_CHECK(!name.empty(), "a member needs a name");
    zip_source_t* source = zip_source_buffer(archive.get(), content.data(), content.size(), 0);
    const zip_int64_t member = zip_file_add(archive.get(), name.c_str(), source, ZIP_FL_ENC_UTF_8);
    if (member < 0) {
      zip_source_free(source);
      throw EnvironmentError("zip", zip_strerror(archive.get()));
    }
    const auto added = static_cast<zip_uint64_t>(member);
    // A fixed date, the first that zip knows: the bytes depend on the members alone.
    if (zip_set_file_compression(archive.get(), added, deflate ? ZIP_CM_DEFLATE : ZIP_CM_STORE,
                                 0) != 0 ||
        zip_file_set_dostime(archive.get(), added, 0, 0x21, 0) != 0) {
      throw EnvironmentError("zip", zip_strerror(archive.get()));
    }
  }
  if (zip_close(archive.get()) != 0) {
    throw EnvironmentError("zip", zip_strerror(archive.get()));
  }
  static_cast<void>(archive.release());  // zip_close has freed it
  if (zip_source_open(target) != 0) {
    return {};  // no members: libzip writes no bytes at all
  }
  std::vector<std::byte> bytes;
  zip_source_seek(target, 0, SEEK_END);
  bytes.resize(static_cast<std::size_t>(zip_source_tell(target)));
  zip_source_seek(target, 0, SEEK_SET);
  const zip_int64_t count = zip_source_read(target, bytes.data(), bytes.size());
  zip_source_close(target);
  ATELIER_CHECK(count == static_cast<zip_int64_t>(bytes.size()), "a buffer is read whole");
  return bytes;
}

}  // namespace atelier
