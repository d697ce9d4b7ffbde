#include "core/io/hdf5_walk.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <set>
#include <utility>

#include <hdf5.h>

#include "core/error.h"

namespace atelier {
namespace {

constexpr int kDepth = 32;
constexpr std::size_t kNameBytes = 1024;

[[noreturn]] void refuse(const std::string& name, const std::string& found,
                         const std::string& expected) {
  throw DataError("", name, found, expected);
}

/// An HDF5 object, closed at the end of its scope; making one from a failed call is a refusal.
class Object {
 public:
  Object(hid_t id, herr_t (*closer)(hid_t), const std::string& name, const char* what)
      : id_(id), closer_(closer) {
    if (id_ < 0) {
      H5Eclear2(H5E_DEFAULT);
      refuse(name, std::string("cannot read ") + what, "sound HDF5");
    }
  }
  ~Object() {
    if (id_ >= 0) {
      closer_(id_);
    }
  }
  Object(Object&& other) noexcept : id_(std::exchange(other.id_, -1)), closer_(other.closer_) {}
  Object(const Object&) = delete;
  Object& operator=(const Object&) = delete;
  Object& operator=(Object&&) = delete;
  hid_t id() const { return id_; }

 private:
  hid_t id_;
  herr_t (*closer_)(hid_t);
};

// --- a driver that reads from memory ------------------------------------------------------------

/// HDF5's view of an open file: the bytes, and how far it thinks that they are used.
struct MemoryFile {
  H5FD_t base;  // HDF5 takes a pointer to it for a pointer to the file
  std::span<const std::byte> bytes;
  haddr_t end;
};

const MemoryFile& memory_file(const H5FD_t* file) {
  return *reinterpret_cast<const MemoryFile*>(file);
}

H5FD_t* open_memory(const char*, unsigned flags, hid_t access, haddr_t) {
  const auto* bytes = static_cast<const std::span<const std::byte>*>(H5Pget_driver_info(access));
  if (bytes == nullptr || flags != H5F_ACC_RDONLY) {
    return nullptr;
  }
  return &(new MemoryFile{{}, *bytes, 0})->base;
}

herr_t close_memory(H5FD_t* file) {
  delete reinterpret_cast<MemoryFile*>(file);
  return 0;
}

herr_t query_memory(const H5FD_t*, unsigned long* flags) {
  *flags = 0;
  return 0;
}

haddr_t used_end(const H5FD_t* file, H5FD_mem_t) {
  return memory_file(file).end;
}

herr_t set_used_end(H5FD_t* file, H5FD_mem_t, haddr_t end) {
  reinterpret_cast<MemoryFile*>(file)->end = end;
  return 0;
}

haddr_t file_end(const H5FD_t* file, H5FD_mem_t) {
  return memory_file(file).bytes.size();
}

herr_t read_memory(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t address, size_t size, void* target) {
  const std::span<const std::byte> bytes = memory_file(file).bytes;
  if (address > bytes.size() || size > bytes.size() - address) {
    return -1;
  }
  std::memcpy(target, bytes.data() + address, size);
  return 0;
}

herr_t write_memory(H5FD_t*, H5FD_mem_t, hid_t, haddr_t, size_t, const void*) {
  return -1;
}

/// Registers the driver.
hid_t memory_driver() {
  H5FD_class_t driver{};
#ifdef H5FD_CLASS_VERSION
  driver.version = H5FD_CLASS_VERSION;
  driver.value = static_cast<H5FD_class_value_t>(600);
#endif
  driver.name = "atelier-memory";
  driver.maxaddr = HADDR_MAX;
  driver.fc_degree = H5F_CLOSE_STRONG;
  driver.fapl_size = sizeof(std::span<const std::byte>);
  driver.open = open_memory;
  driver.close = close_memory;
  driver.query = query_memory;
  driver.get_eoa = used_end;
  driver.set_eoa = set_used_end;
  driver.get_eof = file_end;
  driver.read = read_memory;
  driver.write = write_memory;
  const H5FD_mem_t map[H5FD_MEM_NTYPES] = H5FD_FLMAP_DICHOTOMY;
  std::copy(std::begin(map), std::end(map), std::begin(driver.fl_map));
  return H5FDregister(&driver);
}

// --- files --------------------------------------------------------------------------------------

/// One open file and what may be read from it.
class File {
 public:
  File(std::span<const std::byte> bytes, const Limits& limits)
      : limits_(limits), file_(open(bytes)) {}

  ForeignHdf5Contents contents();
  Tensor read(const std::string& name) const;

 private:
  static Object open(std::span<const std::byte> bytes) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    H5PLset_loading_state(0);
    const hid_t driver = memory_driver();
    Object access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "", "property list");
    if (driver < 0 || H5Pset_driver(access.id(), driver, &bytes) < 0) {
      refuse("", "no driver", "HDF5 1.10");
    }
    return {H5Fopen("memory", H5F_ACC_RDONLY, access.id()), H5Fclose, "",
            "the file: no HDF5, or damaged"};
  }

  Object child(const Object& parent, const std::string& part, const std::string& name) const;
  std::vector<std::string> links_of(const Object& group, const std::string& name) const;
  std::vector<std::string> attributes_of(const Object& object, const std::string& name) const;
  void visit(const Object& object, const std::string& name, int depth);
  void leave_out(const std::string& name, const std::string& why);
  void count(const std::string& name);

  const Limits& limits_;
  Object file_;
  ForeignHdf5Contents contents_;
  std::set<haddr_t> seen_;
  std::int64_t counted_ = 0;
};

/// Type that HDF5 converts the elements to, and its name here.
struct MemoryType {
  ElementType type = ElementType::Float64;
  hid_t hdf5 = -1;
  bool variable_text = false;
  std::size_t text_bytes = 0;  ///< of strings of fixed length
  H5T_cset_t text_set = H5T_CSET_ASCII;
};

MemoryType integer_type(const Object& type, const std::string& name) {
  const bool is_signed = H5Tget_sign(type.id()) == H5T_SGN_2;
  switch (H5Tget_size(type.id())) {
    case 1:
      return is_signed ? MemoryType{ElementType::Int8, H5T_NATIVE_INT8}
                       : MemoryType{ElementType::UInt8, H5T_NATIVE_UINT8};
    case 2:
      return is_signed ? MemoryType{ElementType::Int16, H5T_NATIVE_INT16}
                       : MemoryType{ElementType::UInt16, H5T_NATIVE_UINT16};
    case 4:
      return is_signed ? MemoryType{ElementType::Int32, H5T_NATIVE_INT32}
                       : MemoryType{ElementType::UInt32, H5T_NATIVE_UINT32};
    case 8:
      return is_signed ? MemoryType{ElementType::Int64, H5T_NATIVE_INT64}
                       : MemoryType{ElementType::UInt64, H5T_NATIVE_UINT64};
    default:
      refuse(name, "integers of " + std::to_string(H5Tget_size(type.id())) + " bytes",
             "1, 2, 4 or 8 bytes");
  }
}

/// True for the enumeration that h5py makes of NumPy's bool.
bool is_bool(const Object& type) {
  if (H5Tget_size(type.id()) != 1 || H5Tget_nmembers(type.id()) != 2) {
    return false;
  }
  for (unsigned i = 0; i < 2; ++i) {
    std::int8_t value = -1;
    char* label = H5Tget_member_name(type.id(), i);
    const bool good = label != nullptr && H5Tget_member_value(type.id(), i, &value) >= 0 &&
                      std::string_view(label) == (value == 0 ? "FALSE" : "TRUE") &&
                      (value == 0 || value == 1);
    H5free_memory(label);
    if (!good) {
      return false;
    }
  }
  return true;
}

MemoryType memory_type(const Object& type, const std::string& name, const Limits& limits) {
  switch (H5Tget_class(type.id())) {
    case H5T_INTEGER:
      return integer_type(type, name);
    case H5T_FLOAT:
      switch (H5Tget_size(type.id())) {
        case 2:
        case 4:
          return {ElementType::Float32, H5T_NATIVE_FLOAT};
        case 8:
          return {ElementType::Float64, H5T_NATIVE_DOUBLE};
        default:
          refuse(name,
                 "floating-point numbers of " + std::to_string(H5Tget_size(type.id())) + " bytes",
                 "2, 4 or 8 bytes");
      }
    case H5T_ENUM: {
      const Object base(H5Tget_super(type.id()), H5Tclose, name, "the enumeration");
      MemoryType integers = integer_type(base, name);
      if (is_bool(type)) {
        integers.type = ElementType::Bool;
      }
      return integers;
    }
    case H5T_STRING: {
      if (H5Tis_variable_str(type.id()) > 0) {
        return {ElementType::Text, -1, true, 0, H5Tget_cset(type.id())};
      }
      const std::size_t size = H5Tget_size(type.id());
      if (size == 0 || static_cast<std::int64_t>(size) > limits.text_string_bytes) {
        refuse(name, "strings of " + std::to_string(size) + " bytes",
               "at most " + std::to_string(limits.text_string_bytes));
      }
      return {ElementType::Text, -1, false, size, H5Tget_cset(type.id())};
    }
    case H5T_COMPOUND:
      refuse(name, "a compound type", "numbers or strings");
    case H5T_REFERENCE:
      refuse(name, "references", "numbers or strings");
    case H5T_VLEN:
      refuse(name, "lists of variable length", "numbers or strings");
    case H5T_ARRAY:
      refuse(name, "an array type", "numbers or strings");
    default:
      refuse(name, "a type that is neither number nor string", "numbers or strings");
  }
}

/// Sizes of a dataspace, judged before anything is read.
std::vector<std::int64_t> sizes_of(const Object& space, const MemoryType& type,
                                   const std::string& name, const Limits& limits) {
  if (H5Sget_simple_extent_type(space.id()) == H5S_NULL) {
    refuse(name, "no value", "numbers or strings");
  }
  const int rank = H5Sget_simple_extent_ndims(space.id());
  if (rank < 0 || rank > limits.tensor_rank) {
    refuse(name, std::to_string(rank) + " dimensions",
           "at most " + std::to_string(limits.tensor_rank));
  }
  std::array<hsize_t, H5S_MAX_RANK> sizes{};
  if (H5Sget_simple_extent_dims(space.id(), sizes.data(), nullptr) != rank) {
    refuse(name, "cannot read the shape", "sound HDF5");
  }
  std::vector<std::int64_t> shape;
  for (int d = 0; d < rank; ++d) {
    const hsize_t size = sizes[static_cast<std::size_t>(d)];
    shape.push_back(size > (hsize_t{1} << 62) ? -1 : static_cast<std::int64_t>(size));
  }
  const auto bytes = static_cast<std::int64_t>(type.type == ElementType::Text
                                                   ? std::max<std::size_t>(type.text_bytes, 16)
                                                   : element_bytes(type.type));
  const std::int64_t most =
      std::min(limits.tensor_bytes / bytes,
               type.type == ElementType::Text ? limits.text_values : limits.tensor_bytes);
  if (!element_count(shape, most)) {
    refuse(name, "shape " + shape_text(shape), "at most " + std::to_string(most) + " elements");
  }
  return shape;
}

/// Refuses storage that reaches out of the file, plug-in filters and declared sizes that nothing in
/// the file pays for.
void check_storage(const Object& set, const std::vector<std::int64_t>& shape,
                   const MemoryType& type, const std::string& name, const Limits& limits) {
  const Object list(H5Dget_create_plist(set.id()), H5Pclose, name, "its properties");
  const H5D_layout_t layout = H5Pget_layout(list.id());
  if (layout == H5D_VIRTUAL) {
    refuse(name, "a virtual dataset", "data in this file");
  }
  if (layout != H5D_COMPACT && layout != H5D_CONTIGUOUS && layout != H5D_CHUNKED) {
    refuse(name, "an unknown layout", "compact, contiguous or chunked");
  }
  if (H5Pget_external_count(list.id()) != 0) {
    refuse(name, "data in another file", "data in this file");
  }
  const int filters = H5Pget_nfilters(list.id());
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0;
    unsigned config = 0;
    std::size_t values = 0;
    const H5Z_filter_t filter = H5Pget_filter2(list.id(), static_cast<unsigned>(i), &flags, &values,
                                               nullptr, 0, nullptr, &config);
    if (filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_SHUFFLE &&
        filter != H5Z_FILTER_FLETCHER32) {
      refuse(name, "filter " + std::to_string(filter), "deflate, shuffle or fletcher32");
    }
  }
  const auto item = static_cast<std::int64_t>(std::max<std::size_t>(
      type.type == ElementType::Text ? type.text_bytes : element_bytes(type.type), 1));
  const std::int64_t declared = element_count(shape, limits.tensor_bytes).value_or(0) * item;
  const auto stored =
      static_cast<std::int64_t>(std::min<hsize_t>(H5Dget_storage_size(set.id()), hsize_t{1} << 62));
  if (declared > limits.inflate_free_bytes && declared / limits.inflate_ratio > stored) {
    refuse(name, std::to_string(declared) + " bytes out of " + std::to_string(stored),
           "at most " + std::to_string(limits.inflate_ratio) + " times the stored bytes");
  }
}

/// Reads elements by `read(memory type, target)`.
template <class Read>
Tensor read_elements(const Object& space, MemoryType type, std::vector<std::int64_t> shape,
                     const std::string& name, const Limits& limits, const Read& read) {
  Tensor tensor{type.type, std::move(shape), {}, {}};
  const auto count =
      static_cast<std::size_t>(element_count(tensor.shape, limits.tensor_bytes).value_or(0));
  if (count == 0) {
    return tensor;
  }
  const auto check = [&](herr_t status) {
    if (status < 0) {
      H5Eclear2(H5E_DEFAULT);
      refuse(name, "cannot read the elements", "sound HDF5");
    }
  };
  if (type.type != ElementType::Text) {
    tensor.data.resize(count * element_bytes(type.type));
    check(read(type.hdf5, tensor.data.data()));
    if (type.type == ElementType::Bool) {
      for (std::byte& value : tensor.data) {
        value = value == std::byte{0} ? std::byte{0} : std::byte{1};
      }
    }
    return tensor;
  }
  const Object text(H5Tcopy(H5T_C_S1), H5Tclose, name, "text type");
  H5Tset_cset(text.id(), type.text_set);
  if (!type.variable_text) {
    std::vector<char> buffer(count * type.text_bytes);
    H5Tset_size(text.id(), type.text_bytes);
    H5Tset_strpad(text.id(), H5T_STR_NULLPAD);
    check(read(text.id(), buffer.data()));
    for (std::size_t i = 0; i < count; ++i) {
      const char* begin = buffer.data() + i * type.text_bytes;
      tensor.strings.emplace_back(begin, strnlen(begin, type.text_bytes));
    }
    return tensor;
  }
  std::vector<char*> buffer(count, nullptr);
  H5Tset_size(text.id(), H5T_VARIABLE);
  check(read(text.id(), buffer.data()));
  for (const char* value : buffer) {
    const std::string_view view = value == nullptr ? "" : value;
    if (static_cast<std::int64_t>(view.size()) > limits.text_string_bytes) {
      refuse(name, "a string of " + std::to_string(view.size()) + " bytes",
             "at most " + std::to_string(limits.text_string_bytes));
    }
    tensor.strings.emplace_back(view);
  }
  H5Dvlen_reclaim(text.id(), space.id(), H5P_DEFAULT, buffer.data());
  return tensor;
}

Tensor dataset_of(const Object& set, const std::string& name, const Limits& limits,
                  bool with_data) {
  const Object stored(H5Dget_type(set.id()), H5Tclose, name, "the type");
  const Object space(H5Dget_space(set.id()), H5Sclose, name, "the shape");
  const MemoryType type = memory_type(stored, name, limits);
  const std::vector<std::int64_t> shape = sizes_of(space, type, name, limits);
  check_storage(set, shape, type, name, limits);
  if (!with_data) {
    return {type.type, shape, {}, {}};
  }
  return read_elements(space, type, shape, name, limits, [&](hid_t memory, void* target) {
    return H5Dread(set.id(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, target);
  });
}

Tensor attribute_of(const Object& object, const std::string& attribute, const std::string& name,
                    const Limits& limits) {
  if (H5Aexists(object.id(), attribute.c_str()) <= 0) {
    refuse(name, "no such attribute", "one that the file has");
  }
  const Object opened(H5Aopen(object.id(), attribute.c_str(), H5P_DEFAULT), H5Aclose, name,
                      "the attribute");
  const Object stored(H5Aget_type(opened.id()), H5Tclose, name, "the type");
  const Object space(H5Aget_space(opened.id()), H5Sclose, name, "the shape");
  const MemoryType type = memory_type(stored, name, limits);
  return read_elements(
      space, type, sizes_of(space, type, name, limits), name, limits,
      [&](hid_t memory, void* target) { return H5Aread(opened.id(), memory, target); });
}

void File::count(const std::string& name) {
  if (++counted_ > limits_.archive_entries) {
    refuse(name, "more than " + std::to_string(limits_.archive_entries) + " names", "fewer");
  }
}

void File::leave_out(const std::string& name, const std::string& why) {
  contents_.left_out.emplace(name, why);
}

std::vector<std::string> File::links_of(const Object& group, const std::string& name) const {
  struct Names {
    std::vector<std::string> names;
    std::size_t most;
  } found{{}, static_cast<std::size_t>(limits_.archive_entries)};
  const herr_t status = H5Literate(
      group.id(), H5_INDEX_NAME, H5_ITER_NATIVE, nullptr,
      [](hid_t, const char* link, const H5L_info_t*, void* data) -> herr_t {
        auto& into = *static_cast<Names*>(data);
        into.names.emplace_back(link, strnlen(link, kNameBytes));
        return into.names.size() > into.most ? 1 : 0;
      },
      &found);
  if (status < 0) {
    H5Eclear2(H5E_DEFAULT);
    refuse(name, "cannot read the links of the group", "sound HDF5");
  }
  return found.names;
}

std::vector<std::string> File::attributes_of(const Object& object, const std::string& name) const {
  struct Names {
    std::vector<std::string> names;
    std::size_t most;
  } found{{}, static_cast<std::size_t>(limits_.archive_entries)};
  hsize_t begin = 0;
  const herr_t status = H5Aiterate2(
      object.id(), H5_INDEX_NAME, H5_ITER_NATIVE, &begin,
      [](hid_t, const char* attribute, const H5A_info_t*, void* data) -> herr_t {
        auto& into = *static_cast<Names*>(data);
        into.names.emplace_back(attribute, strnlen(attribute, kNameBytes));
        return into.names.size() > into.most ? 1 : 0;
      },
      &found);
  if (status < 0) {
    H5Eclear2(H5E_DEFAULT);
    refuse(name, "cannot read the attributes", "sound HDF5");
  }
  return found.names;
}

/// Opens what a hard link leads to.
Object File::child(const Object& parent, const std::string& part, const std::string& name) const {
  if (part.empty() || part == "." || part.find('/') != std::string::npos ||
      H5Lexists(parent.id(), part.c_str(), H5P_DEFAULT) <= 0) {
    H5Eclear2(H5E_DEFAULT);
    refuse(name, "no such object", "one that the file has");
  }
  H5L_info_t info{};
  if (H5Lget_info(parent.id(), part.c_str(), &info, H5P_DEFAULT) < 0) {
    refuse(name, "cannot read the link", "sound HDF5");
  }
  if (info.type == H5L_TYPE_SOFT) {
    refuse(name, "a soft link", "a hard link");
  }
  if (info.type != H5L_TYPE_HARD) {
    refuse(name, "a link to another file", "a hard link");
  }
  return {H5Oopen(parent.id(), part.c_str(), H5P_DEFAULT), H5Oclose, name, "the object"};
}

void File::visit(const Object& object, const std::string& name, int depth) {
  H5O_info_t info{};
  if (H5Oget_info(object.id(), &info) < 0) {
    refuse(name, "cannot read the object", "sound HDF5");
  }
  if (!seen_.insert(info.addr).second) {
    leave_out(name, "the same object under a second name");
    return;
  }
  for (const std::string& attribute : attributes_of(object, name)) {
    count(name);
    contents_.attributes.push_back(name);
    contents_.attributes.back().append("@").append(attribute);
  }
  const H5I_type_t kind = H5Iget_type(object.id());
  if (kind == H5I_DATASET) {
    contents_.datasets.emplace(name, dataset_of(object, name, limits_, false));
    return;
  }
  if (kind != H5I_GROUP) {
    leave_out(name, "a named type");
    return;
  }
  if (depth == kDepth) {
    leave_out(name, "deeper than " + std::to_string(kDepth) + " groups");
    return;
  }
  for (const std::string& part : links_of(object, name)) {
    std::string full = name;
    full.append(name.empty() ? "" : "/").append(part);
    count(full);
    try {
      visit(child(object, part, full), full, depth + 1);
    } catch (const DataError& error) {
      // A listing tells everything that is there; what cannot be read is named with its reason.
      if (counted_ > limits_.archive_entries) {
        throw;
      }
      leave_out(error.where.empty() ? full : error.where, error.found);
    }
  }
}

ForeignHdf5Contents File::contents() {
  const Object root(H5Gopen2(file_.id(), "/", H5P_DEFAULT), H5Gclose, "", "the root group");
  visit(root, "", 0);
  return std::move(contents_);
}

Tensor File::read(const std::string& name) const {
  const std::size_t at = name.find('@');
  const std::string path = name.substr(0, at);
  std::optional<Object> object;
  object.emplace(H5Gopen2(file_.id(), "/", H5P_DEFAULT), H5Gclose, name, "the root group");
  for (std::size_t begin = 0; begin < path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    Object next = child(*object, path.substr(begin, end - begin), name);
    object.emplace(std::move(next));
    begin = end + 1;
  }
  if (at != std::string::npos) {
    return attribute_of(*object, name.substr(at + 1), name, limits_);
  }
  if (H5Iget_type(object->id()) != H5I_DATASET) {
    refuse(name, "no dataset", "a dataset");
  }
  return dataset_of(*object, name, limits_, true);
}

}  // namespace

ForeignHdf5Contents walk_hdf5(std::span<const std::byte> bytes, const Limits& limits) {
  return File(bytes, limits).contents();
}

std::vector<Tensor> read_hdf5(std::span<const std::byte> bytes,
                              const std::vector<std::string>& names, const Limits& limits) {
  const File file(bytes, limits);
  std::vector<Tensor> tensors;
  tensors.reserve(names.size());
  for (const std::string& name : names) {
    tensors.push_back(file.read(name));
  }
  return tensors;
}

}  // namespace atelier
