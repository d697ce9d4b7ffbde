#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include <hdf5.h>

#include "core/archive.h"
#include "core/archive_index.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hdf5_lock.h"
#include "core/sha256.h"

namespace atelier {
namespace {

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

/// The innermost reason on HDF5's error stack.
std::string hdf5_reason() {
  std::string reason = "HDF5 gives no reason";
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* error, void* text) -> herr_t {
        *static_cast<std::string*>(text) = std::string(error->func_name) + ": " + error->desc;
        return 1;  // the first is enough
      },
      &reason);
  H5Eclear2(H5E_DEFAULT);
  return reason;
}

/// An HDF5 object. `close` says whether it worked; the destructor is for unwinding.
class Handle {
 public:
  Handle(hid_t id, herr_t (*closer)(hid_t), const std::filesystem::path& path, const char* call)
      : id_(id), closer_(closer), path_(path), call_(call) {
    if (id_ < 0) {
      throw EnvironmentError(path_.string(), std::string(call_) + " failed: " + hdf5_reason());
    }
  }
  ~Handle() {
    if (id_ >= 0) {
      closer_(id_);
    }
  }
  Handle(Handle&& other) noexcept
      : id_(std::exchange(other.id_, -1)),
        closer_(other.closer_),
        path_(other.path_),
        call_(other.call_) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;
  hid_t id() const { return id_; }
  void close() {
    if (closer_(std::exchange(id_, -1)) < 0) {
      throw EnvironmentError(path_.string(),
                             std::string("closing after ") + call_ + " failed: " + hdf5_reason());
    }
  }

 private:
  hid_t id_;
  herr_t (*closer_)(hid_t);
  const std::filesystem::path& path_;
  const char* call_;
};

/// Writes one archive and reads it back. One object per file; the mutex is held.
class Hdf5File {
 public:
  /// @param path  for errors
  explicit Hdf5File(const std::filesystem::path& path) : path_(path) {
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }

  std::vector<ArchivedDataset> write(const std::filesystem::path& name, const Archive& archive,
                                     std::uint64_t block_bytes) {
    Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose, path_, "H5Pcreate");
    check(H5Pset_userblock(creation.id(), block_bytes), "H5Pset_userblock");
    check(H5Pset_obj_track_times(creation.id(), false), "H5Pset_obj_track_times");
    Handle access = access_list();
    Handle file(H5Fcreate(name.c_str(), H5F_ACC_TRUNC, creation.id(), access.id()), H5Fclose, path_,
                "H5Fcreate");
    write_attributes(file.id(), archive);
    std::vector<ArchivedDataset> entries;
    for (const auto& [dataset, tensor] : archive.datasets) {
      entries.push_back(write_dataset(file.id(), dataset, tensor));
    }
    check(H5Fflush(file.id(), H5F_SCOPE_GLOBAL), "H5Fflush");
    for (ArchivedDataset& entry : entries) {
      find_chunks(file.id(), entry);
    }
    file.close();
    return entries;
  }

  /// Reads every dataset by HDF5 itself, which compares the checksums, and compares the digests of
  /// what was to be written and of what is there.
  void compare(const std::filesystem::path& name, const Archive& archive) {
    Handle access = access_list();
    Handle file(H5Fopen(name.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose, path_, "H5Fopen");
    for (const auto& [dataset, tensor] : archive.datasets) {
      const std::vector<std::byte> expected = file_bytes(tensor, text_bytes(tensor));
      std::vector<std::byte> found(expected.size());
      Handle set(H5Dopen2(file.id(), dataset.c_str(), H5P_DEFAULT), H5Dclose, path_, "H5Dopen");
      if (!found.empty()) {
        Handle type = type_of(tensor.type, text_bytes(tensor));
        check(H5Dread(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, found.data()), "H5Dread");
      }
      if (sha256(found.data(), found.size()) != sha256(expected.data(), expected.size())) {
        throw EnvironmentError(path_.string(),
                               "what was written to " + dataset + " is not what is read back");
      }
      set.close();
    }
    file.close();
  }

  /// Bytes of each string of a Text dataset, 0 for numbers.
  static std::size_t text_bytes(const Tensor& tensor) {
    std::size_t longest = tensor.type == ElementType::Text ? 1 : 0;
    for (const std::string& text : tensor.strings) {
      longest = std::max(longest, text.size());
    }
    return longest;
  }

  /// The elements as they stand in the file.
  static std::vector<std::byte> file_bytes(const Tensor& tensor, std::size_t text_bytes) {
    if (tensor.type != ElementType::Text) {
      return tensor.data;
    }
    std::vector<std::byte> bytes(tensor.strings.size() * text_bytes);
    for (std::size_t i = 0; i < tensor.strings.size(); ++i) {
      std::memcpy(bytes.data() + i * text_bytes, tensor.strings[i].data(),
                  tensor.strings[i].size());
    }
    return bytes;
  }

 private:
  void check(herr_t status, const char* call) const {
    if (status < 0) {
      throw EnvironmentError(path_.string(), std::string(call) + " failed: " + hdf5_reason());
    }
  }

  /// The file format of HDF5 1.10, whose metadata carry checksums; no lock: the temporary file is
  /// nobody else's, and network file systems may refuse locks.
  Handle access_list() const {
    Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, path_, "H5Pcreate");
    check(H5Pset_libver_bounds(access.id(), H5F_LIBVER_V110, H5F_LIBVER_V110),
          "H5Pset_libver_bounds");
    check(H5Pset_file_locking(access.id(), false, true), "H5Pset_file_locking");
    return access;
  }

  /// Bool is the enumeration that h5py takes for NumPy's bool.
  Handle type_of(ElementType type, std::size_t text_bytes) const {
    const auto copy = [&](hid_t native) {
      return Handle(H5Tcopy(native), H5Tclose, path_, "H5Tcopy");
    };
    switch (type) {
      case ElementType::Int8:
        return copy(H5T_STD_I8LE);
      case ElementType::Int16:
        return copy(H5T_STD_I16LE);
      case ElementType::Int32:
        return copy(H5T_STD_I32LE);
      case ElementType::Int64:
        return copy(H5T_STD_I64LE);
      case ElementType::UInt8:
        return copy(H5T_STD_U8LE);
      case ElementType::UInt16:
        return copy(H5T_STD_U16LE);
      case ElementType::UInt32:
        return copy(H5T_STD_U32LE);
      case ElementType::UInt64:
        return copy(H5T_STD_U64LE);
      case ElementType::Float32:
        return copy(H5T_IEEE_F32LE);
      case ElementType::Float64:
        return copy(H5T_IEEE_F64LE);
      case ElementType::Bool: {
        Handle boolean(H5Tenum_create(H5T_STD_I8LE), H5Tclose, path_, "H5Tenum_create");
        for (const std::int8_t value : {std::int8_t{0}, std::int8_t{1}}) {
          check(H5Tenum_insert(boolean.id(), value == 0 ? "FALSE" : "TRUE", &value),
                "H5Tenum_insert");
        }
        return boolean;
      }
      default: {
        Handle text(H5Tcopy(H5T_C_S1), H5Tclose, path_, "H5Tcopy");
        check(H5Tset_size(text.id(), text_bytes), "H5Tset_size");
        check(H5Tset_strpad(text.id(),
                            text_bytes == H5T_VARIABLE ? H5T_STR_NULLTERM : H5T_STR_NULLPAD),
              "H5Tset_strpad");
        check(H5Tset_cset(text.id(), H5T_CSET_UTF8), "H5Tset_cset");
        return text;
      }
    }
  }

  void write_attribute(hid_t file, const std::string& name, hid_t type, const void* value) const {
    Handle space(H5Screate(H5S_SCALAR), H5Sclose, path_, "H5Screate");
    Handle attribute(H5Acreate2(file, name.c_str(), type, space.id(), H5P_DEFAULT, H5P_DEFAULT),
                     H5Aclose, path_, "H5Acreate");
    check(H5Awrite(attribute.id(), type, value), "H5Awrite");
    attribute.close();
  }

  /// Of variable length: h5py gives these as str, others as bytes.
  void write_text(hid_t file, const std::string& name, const std::string& text) const {
    Handle type = type_of(ElementType::Text, H5T_VARIABLE);
    const char* value = text.c_str();
    write_attribute(file, name, type.id(), &value);
  }

  void write_attributes(hid_t file, const Archive& archive) const {
    write_text(file, "schema", archive.schema);
    write_attribute(file, "schema_version", H5T_STD_I32LE, &archive.version);
    write_text(file, "units", archive.units);
    write_text(file, "up_axis", archive.up_axis);
    for (const auto& [name, value] : archive.numbers) {
      write_attribute(file, name, H5T_IEEE_F64LE, &value);
    }
    for (const auto& [name, value] : archive.texts) {
      write_text(file, name, value);
    }
  }

  /// The groups that a name goes through, where they are missing. HDF5 would make them itself, but
  /// with the time of day in them, and the same archive has the same bytes.
  void make_groups(hid_t file, const std::string& name) const {
    Handle creation(H5Pcreate(H5P_GROUP_CREATE), H5Pclose, path_, "H5Pcreate");
    check(H5Pset_obj_track_times(creation.id(), false), "H5Pset_obj_track_times");
    for (std::size_t end = name.find('/'); end != std::string::npos;
         end = name.find('/', end + 1)) {
      const std::string group = name.substr(0, end);
      const htri_t exists = H5Lexists(file, group.c_str(), H5P_DEFAULT);
      check(exists, "H5Lexists");
      if (exists == 0) {
        Handle made(H5Gcreate2(file, group.c_str(), H5P_DEFAULT, creation.id(), H5P_DEFAULT),
                    H5Gclose, path_, "H5Gcreate");
        made.close();
      }
    }
  }

  ArchivedDataset write_dataset(hid_t file, const std::string& name, const Tensor& tensor) const {
    ArchivedDataset entry{name, tensor.type, text_bytes(tensor), tensor.shape, 0, {}};
    const std::vector<hsize_t> sizes(tensor.shape.begin(), tensor.shape.end());
    const std::vector<std::byte> bytes = file_bytes(tensor, entry.text_bytes);
    const int rank = static_cast<int>(sizes.size());
    Handle space(H5Screate_simple(rank, sizes.data(), nullptr), H5Sclose, path_,
                 "H5Screate_simple");
    Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, path_, "H5Pcreate");
    check(H5Pset_obj_track_times(creation.id(), false), "H5Pset_obj_track_times");
    if (!bytes.empty()) {
      const std::size_t row = bytes.size() / static_cast<std::size_t>(sizes[0]);
      ATELIER_CHECK(row < (std::size_t{1} << 32) - 8, "a row of " + name + " is too long for HDF5");
      std::vector<hsize_t> chunk = sizes;
      chunk[0] = std::clamp<hsize_t>(kChunkBytes / row, 1, sizes[0]);
      entry.chunk_rows = static_cast<std::int64_t>(chunk[0]);
      check(H5Pset_chunk(creation.id(), rank, chunk.data()), "H5Pset_chunk");
      check(H5Pset_fletcher32(creation.id()), "H5Pset_fletcher32");
    }
    make_groups(file, name);
    Handle type = type_of(tensor.type, entry.text_bytes);
    Handle set(H5Dcreate2(file, name.c_str(), type.id(), space.id(), H5P_DEFAULT, creation.id(),
                          H5P_DEFAULT),
               H5Dclose, path_, "H5Dcreate");
    if (!bytes.empty()) {
      check(H5Dwrite(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()), "H5Dwrite");
    }
    set.close();
    return entry;
  }

  void find_chunks(hid_t file, ArchivedDataset& entry) const {
    if (entry.chunk_rows == 0) {
      return;
    }
    Handle set(H5Dopen2(file, entry.name.c_str(), H5P_DEFAULT), H5Dclose, path_, "H5Dopen");
    std::vector<hsize_t> begin(entry.shape.size(), 0);
    for (std::int64_t row = 0; row < entry.shape[0]; row += entry.chunk_rows) {
      begin[0] = static_cast<hsize_t>(row);
      unsigned filters = 0;
      haddr_t address = HADDR_UNDEF;
      hsize_t size = 0;
      check(H5Dget_chunk_info_by_coord(set.id(), begin.data(), &filters, &address, &size),
            "H5Dget_chunk_info_by_coord");
      entry.offsets.push_back(address);
    }
    set.close();
  }

  const std::filesystem::path& path_;
};

void check_writable(const Archive& archive) {
  const auto name_check = [](const std::string& name, bool slashes) {
    ATELIER_CHECK(is_archive_name(name, slashes), "no name for an archive: \"" + name + "\"");
  };
  name_check(archive.schema, false);
  name_check(archive.units, false);
  ATELIER_CHECK(archive.version >= 1, "versions count from 1");
  ATELIER_CHECK(archive.up_axis == "x" || archive.up_axis == "y" || archive.up_axis == "z",
                "the up axis is x, y or z, not " + archive.up_axis);
  const auto reserved = [](const std::string& name) {
    return name == "schema" || name == "schema_version" || name == "units" || name == "up_axis";
  };
  for (const auto& [name, value] : archive.numbers) {
    name_check(name, false);
    ATELIER_CHECK(std::isfinite(value), name + " is not finite");
    ATELIER_CHECK(!reserved(name) && !archive.texts.contains(name), name + " is there already");
  }
  for (const auto& [name, value] : archive.texts) {
    name_check(name, false);
    // An attribute of the compact form must fit into the object's header.
    ATELIER_CHECK(value.find('\0') == std::string::npos && value.size() < 60'000,
                  name + " holds a NUL or more than 60,000 bytes");
    ATELIER_CHECK(!reserved(name), name + " is there already");
  }
  for (const auto& [name, tensor] : archive.datasets) {
    name_check(name, true);
    check_tensor(tensor);
    ATELIER_CHECK(is_archive_type(tensor.type), name + " holds " + element_type_name(tensor.type));
    ATELIER_CHECK(!tensor.shape.empty() && tensor.shape.size() <= 8,
                  name + " has rank " + std::to_string(tensor.shape.size()));
    for (const std::string& text : tensor.strings) {
      ATELIER_CHECK(text.find('\0') == std::string::npos, name + " holds a NUL");
    }
  }
}

/// The index before it is known where the chunks will lie: as long as it can become.
ArchiveIndex longest_index(const Archive& archive) {
  constexpr std::uint64_t kLongest = std::numeric_limits<std::uint64_t>::max();
  ArchiveIndex index;
  index.block_bytes = kLongest;
  index.file_bytes = kLongest;
  index.head = archive;
  index.head.datasets.clear();
  for (const auto& [name, tensor] : archive.datasets) {
    ArchivedDataset entry{name,
                          tensor.type,
                          Hdf5File::text_bytes(tensor),
                          tensor.shape,
                          std::numeric_limits<std::int64_t>::max(),
                          {}};
    const auto rows = static_cast<std::size_t>(std::max<std::int64_t>(tensor.shape[0], 1));
    const std::size_t bytes = static_cast<std::size_t>(element_count(tensor)) * entry.item_bytes();
    const std::size_t chunk_rows =
        std::max<std::size_t>(kChunkBytes / std::max<std::size_t>(bytes / rows, 1), 1);
    entry.offsets.assign((rows - 1) / chunk_rows + 1, kLongest);
    index.datasets.push_back(std::move(entry));
  }
  return index;
}

/// True if every chunk, `base` added to its offset, holds what was to be written.
bool chunks_hold(const std::filesystem::path& file, const std::vector<ArchivedDataset>& entries,
                 std::uint64_t base, const Archive& archive) {
  std::ifstream stream(file, std::ios::binary);
  for (const ArchivedDataset& entry : entries) {
    const Tensor& tensor = archive.datasets.at(entry.name);
    const std::vector<std::byte> expected = Hdf5File::file_bytes(tensor, entry.text_bytes);
    const std::size_t rows = static_cast<std::size_t>(std::max<std::int64_t>(tensor.shape[0], 1));
    const std::size_t chunk = expected.size() / rows * static_cast<std::size_t>(entry.chunk_rows);
    std::vector<char> found(chunk);
    for (std::size_t i = 0; i < entry.offsets.size(); ++i) {
      const std::size_t bytes = std::min(chunk, expected.size() - i * chunk);
      stream.seekg(static_cast<std::streamoff>(entry.offsets[i] + base));
      if (!stream.read(found.data(), static_cast<std::streamsize>(bytes)) ||
          std::memcmp(found.data(), expected.data() + i * chunk, bytes) != 0) {
        return false;
      }
    }
  }
  return true;
}

/// Turns HDF5's addresses into offsets from the file's beginning. Some versions of the library
/// count them from the end of the user block, some from the beginning: what is there decides.
void place_chunks(const std::filesystem::path& file, ArchiveIndex& index, const Archive& archive,
                  const std::filesystem::path& path) {
  for (const std::uint64_t base : {index.block_bytes, std::uint64_t{0}}) {
    if (chunks_hold(file, index.datasets, base, archive)) {
      for (ArchivedDataset& entry : index.datasets) {
        for (std::uint64_t& offset : entry.offsets) {
          offset += base;
        }
      }
      return;
    }
  }
  throw EnvironmentError(path.string(), "what was written is not where HDF5 says that it is");
}

/// The user block for what HDF5 has left in the file: the digest goes over what is there now, not
/// over what should be there.
std::string user_block(ArchiveIndex index, const std::filesystem::path& file,
                       const std::filesystem::path& path) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  index.file_bytes = static_cast<std::uint64_t>(std::max<std::streamoff>(stream.tellg(), 0));
  std::string block = archive_index_text(index);
  block.resize(static_cast<std::size_t>(index.block_bytes) - kArchiveFirstLine, '\0');
  Sha256 hash;
  hash.update(block);
  stream.seekg(static_cast<std::streamoff>(index.block_bytes));
  std::string buffer(std::size_t{1} << 20, '\0');
  std::uint64_t hashed = index.block_bytes;
  while (stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) ||
         stream.gcount() > 0) {
    hash.update(buffer.data(), static_cast<std::size_t>(stream.gcount()));
    hashed += static_cast<std::uint64_t>(stream.gcount());
  }
  if (hashed != index.file_bytes) {
    throw EnvironmentError(path.string(), "cannot be read back");
  }
  return std::string(kArchiveMagic) + hex(hash.finish()) + "\n" + block;
}

}  // namespace

std::mutex& hdf5_mutex() {
  static std::mutex mutex;
  return mutex;
}

void write_archive(const std::filesystem::path& path, const Archive& archive) {
  check_writable(archive);
  ArchiveIndex index = longest_index(archive);
  index.block_bytes = std::bit_ceil(
      std::max<std::uint64_t>(512, kArchiveFirstLine + archive_index_text(index).size()));
  ATELIER_CHECK(index.block_bytes <= kArchiveBlockMax, "too many chunks for one archive");

  AtomicFile file(path);
  {
    const std::lock_guard lock(hdf5_mutex());
    Hdf5File hdf5(path);
    index.datasets = hdf5.write(file.temporary_path(), archive, index.block_bytes);
    hdf5.compare(file.temporary_path(), archive);
  }
  place_chunks(file.temporary_path(), index, archive, path);
  // HDF5 wrote through another descriptor: this one still stands at byte 0.
  file.write(user_block(index, file.temporary_path(), path));

  // Our own reader must find the same.
  const Archive again = read_archive(file.temporary_path(), archive.schema, archive.version);
  for (const auto& [name, tensor] : archive.datasets) {
    const Tensor& found = again.datasets.at(name);
    if (found.data != tensor.data || found.strings != tensor.strings) {
      throw EnvironmentError(path.string(),
                             "what was written to " + name + " is not what is read back");
    }
  }
  file.commit();
}

}  // namespace atelier
