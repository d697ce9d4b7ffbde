#include "core/io/foreign_hdf5.h"

#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/archive.h"
#include "core/error.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

/// h5py in a child process makes the files; false where there is none.
bool run_h5py(const fixtures::TemporaryDirectory& folder, const std::string& code) {
  std::ofstream(folder / "make.py")
      << "import h5py, numpy as np, os\nos.chdir('" << folder.path().string() << "')\n"
      << code;
  return std::system(("/usr/bin/python3 " + (folder / "make.py").string()).c_str()) == 0;
}
#define ATELIER_NEEDS_H5PY()                                               \
  if (std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") != 0) { \
    GTEST_SKIP() << "no h5py (python3-h5py)";                              \
  }

std::string foreign_hdf5_refusal(const std::filesystem::path& path,
                                 const std::vector<std::string>& names, const Limits& limits = {}) {
  try {
    read_foreign_hdf5(path, names, limits);
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(ForeignHdf5, EveryH5pyType_IsRead) {
  ATELIER_NEEDS_H5PY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_h5py(folder, R"(
with h5py.File('a.h5', 'w') as f:
    f['f4'] = np.array([[1, 2], [3, 4]], 'f4')
    f['f8'] = np.array([0.5])
    f['f2'] = np.array([0.5, -2], 'f2')
    f['be'] = np.array([1, 2], '>i4')
    f['u1'] = np.array([255], 'u1')
    f['i8'] = np.array(-7)
    f['bool'] = np.array([True, False])
    f['names'] = ['hips', 'left \u00e9']
    f['fixed'] = np.array([b'ab', b'c'])
    f['nothing'] = np.zeros((0, 3))
    f['deep/er/x'] = np.arange(3)
    f.create_dataset('packed', data=np.arange(10000).reshape(100, 100), compression='gzip',
                     shuffle=True, fletcher32=True)
    f.create_dataset('sparse', shape=(10,), fillvalue=3.0)
    f.attrs['gender'] = 'female'
    f.attrs['height'] = 1.75
    f['f4'].attrs['unit'] = np.bytes_('m')
    f['deep'].attrs['list'] = [1, 2, 3]
)"));
  const auto found =
      read_foreign_hdf5(folder / "a.h5", {"f4", "f8", "f2", "be", "u1", "i8", "bool", "names",
                                          "fixed", "nothing", "deep/er/x", "packed", "sparse",
                                          "@gender", "@height", "f4@unit", "deep@list"});
  EXPECT_THAT(found.at("f4").shape, ElementsAre(2, 2));
  EXPECT_THAT(doubles_of(found.at("f4")), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(doubles_of(found.at("f8")), ElementsAre(0.5));
  EXPECT_THAT(doubles_of(found.at("f2")), ElementsAre(0.5, -2));
  EXPECT_THAT(integers_of(found.at("be")), ElementsAre(1, 2));
  EXPECT_EQ(found.at("be").type, ElementType::Int32);
  EXPECT_THAT(integers_of(found.at("u1")), ElementsAre(255));
  EXPECT_TRUE(found.at("i8").shape.empty());
  EXPECT_THAT(integers_of(found.at("i8")), ElementsAre(-7));
  EXPECT_EQ(found.at("bool").type, ElementType::Bool);
  EXPECT_THAT(integers_of(found.at("bool")), ElementsAre(1, 0));
  EXPECT_THAT(found.at("names").strings, ElementsAre("hips", "left \xC3\xA9"));
  EXPECT_THAT(found.at("fixed").strings, ElementsAre("ab", "c"));
  EXPECT_THAT(found.at("nothing").shape, ElementsAre(0, 3));
  EXPECT_THAT(integers_of(found.at("deep/er/x")), ElementsAre(0, 1, 2));
  EXPECT_EQ(integers_of(found.at("packed"))[9999], 9999);
  EXPECT_EQ(doubles_of(found.at("sparse"))[9], 3);
  EXPECT_THAT(found.at("@gender").strings, ElementsAre("female"));
  EXPECT_THAT(doubles_of(found.at("@height")), ElementsAre(1.75));
  EXPECT_THAT(found.at("f4@unit").strings, ElementsAre("m"));
  EXPECT_THAT(integers_of(found.at("deep@list")), ElementsAre(1, 2, 3));
}

TEST(ForeignHdf5, Contents_ListDatasetsAttributesAndOmissions) {
  ATELIER_NEEDS_H5PY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_h5py(folder, R"(
with h5py.File('a.h5', 'w') as f:
    f['Camera/00/K'] = np.eye(3)
    f['Camera/00'].attrs['num'] = 3
    f.attrs['actor'] = 'x'
    f['again'] = f['Camera/00/K']
    f['loop'] = f['Camera']
    f['Camera/up'] = f['/']
    f['soft'] = h5py.SoftLink('/Camera')
    f['out'] = h5py.ExternalLink('/etc/passwd', '/')
    f['pairs'] = np.zeros(2, dtype=[('a', 'f4'), ('b', 'i4')])
)"));
  const ForeignHdf5Contents contents = foreign_hdf5_contents(folder / "a.h5");
  ASSERT_EQ(contents.datasets.size(), 1u);
  EXPECT_THAT(contents.datasets.at("Camera/00/K").shape, ElementsAre(3, 3));
  EXPECT_THAT(contents.attributes, UnorderedElementsAre("@actor", "Camera/00@num"));
  EXPECT_EQ(contents.left_out.at("again"), "the same object under a second name");
  EXPECT_EQ(contents.left_out.at("loop"), "the same object under a second name");
  EXPECT_EQ(contents.left_out.at("Camera/up"), "the same object under a second name");
  EXPECT_EQ(contents.left_out.at("soft"), "a soft link");
  EXPECT_EQ(contents.left_out.at("out"), "a link to another file");
  EXPECT_EQ(contents.left_out.at("pairs"), "a compound type");
}

TEST(ForeignHdf5, OwnArchives_AreReadable) {
  const fixtures::TemporaryDirectory folder;
  Archive archive;
  archive.schema = "test.sample";
  archive.datasets["group/points"] = tensor_of(std::vector<double>{1, 2, 3}, {1, 3});
  archive.datasets["names"] = Tensor{ElementType::Text, {2}, {}, {"a", "bc"}};
  archive.datasets["flags"] = Tensor{ElementType::Bool, {1}, {std::byte{1}}, {}};
  write_archive(folder / "a.h5", archive);
  const auto found =
      read_foreign_hdf5(folder / "a.h5", {"group/points", "names", "flags", "@schema", "@units"});
  EXPECT_EQ(found.at("group/points").data, archive.datasets["group/points"].data);
  EXPECT_THAT(found.at("names").strings, ElementsAre("a", "bc"));
  EXPECT_EQ(found.at("flags").type, ElementType::Bool);
  EXPECT_THAT(found.at("@schema").strings, ElementsAre("test.sample"));
  EXPECT_THAT(found.at("@units").strings, ElementsAre("m"));
}

TEST(ForeignHdf5, LinksOutOfTheFile_AreRefused) {
  ATELIER_NEEDS_H5PY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_h5py(folder, R"(
with h5py.File('other.h5', 'w') as f:
    f['x'] = np.arange(3)
with h5py.File('a.h5', 'w') as f:
    f['x'] = np.arange(3)
    f['soft'] = h5py.SoftLink('/x')
    f['loop'] = h5py.SoftLink('/loop')
    f['out'] = h5py.ExternalLink('other.h5', '/x')
    f['dir/out'] = h5py.ExternalLink('other.h5', '/')
    f.create_dataset('raw', (1000,), 'u1', external=[('/etc/passwd', 0, 1000)])
    layout = h5py.VirtualLayout(shape=(3,), dtype='i8')
    layout[:] = h5py.VirtualSource('other.h5', 'x', shape=(3,))
    f.create_virtual_dataset('virtual', layout)
)"));
  EXPECT_EQ(foreign_hdf5_refusal(folder / "a.h5", {"x"}), "");
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"soft"}), HasSubstr("soft: a soft link"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"loop"}), HasSubstr("a soft link"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"out"}),
              HasSubstr("out: a link to another file"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"dir/out/x"}),
              HasSubstr("a link to another file"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"raw"}),
              HasSubstr("raw: data in another file"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"virtual"}),
              HasSubstr("virtual: a virtual dataset"));
}

TEST(ForeignHdf5, NonNumericTypes_AreRefused) {
  ATELIER_NEEDS_H5PY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_h5py(folder, R"(
with h5py.File('a.h5', 'w') as f:
    f['pair'] = np.zeros(2, dtype=[('a', 'f4'), ('b', 'i4')])
    f['complex'] = np.zeros(2, dtype='c16')
    f['list'] = np.array([np.arange(2), np.arange(3)], dtype=h5py.vlen_dtype('i4'))
    f['ref'] = np.array([f.ref], dtype=h5py.ref_dtype)
    f['opaque'] = np.zeros(2, dtype='V4')
    f['array'] = np.zeros(2, dtype=[('a', 'f4', (3,))])
    f['null'] = h5py.Empty('f4')
    f['type'] = np.dtype('f4')
)"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"pair"}), HasSubstr("a compound type"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"complex"}), HasSubstr("a compound type"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"list"}),
              HasSubstr("lists of variable length"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"ref"}), HasSubstr("references"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"opaque"}),
              HasSubstr("neither number nor string"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"array"}), HasSubstr("a compound type"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"null"}), HasSubstr("no value"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"type"}), HasSubstr("no dataset"));
}

TEST(ForeignHdf5, DeclaredSizeBeyondStoredBytes_IsRefused) {
  ATELIER_NEEDS_H5PY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_h5py(folder, R"(
with h5py.File('a.h5', 'w') as f:
    f.create_dataset('terabyte', shape=(1 << 37,), dtype='f8')
    f.create_dataset('gigabyte', shape=(1 << 27,), dtype='f8')
    f.create_dataset('chunked', shape=(1 << 27,), dtype='f8', chunks=(1 << 20,))
    f.create_dataset('overflow', shape=(1 << 40, 1 << 40), dtype='f8', chunks=(1, 1))
    f.create_dataset('zero', shape=(0, 1 << 62), dtype='f8')
    f.create_dataset('bomb', data=np.zeros(1 << 24), compression='gzip', chunks=(1 << 20,))
)"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"terabyte"}), HasSubstr("elements"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"gigabyte"}),
              HasSubstr("times the stored bytes"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"chunked"}),
              HasSubstr("times the stored bytes"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"overflow"}), HasSubstr("elements"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"zero"}), HasSubstr("elements"));
  Limits limits;
  limits.inflate_ratio = 100;
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"bomb"}, limits),
              HasSubstr("times the stored bytes"));
  limits = {};
  limits.worker_memory_bytes = 64 << 20;
  EXPECT_NE(foreign_hdf5_refusal(folder / "a.h5", {"bomb"}, limits), "");
}

TEST(ForeignHdf5, MissingName_IsRefused) {
  ATELIER_NEEDS_H5PY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_h5py(folder, "h5py.File('a.h5', 'w')['x/y'] = np.arange(3)"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"z"}), HasSubstr("z: no such object"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"x"}), HasSubstr("x: no dataset"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"x/../x/y"}), HasSubstr("no such object"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"x/./y"}), HasSubstr("no such object"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"x//y"}), HasSubstr("no such object"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "a.h5", {"x/y@unit"}), HasSubstr("no such attribute"));
  EXPECT_NE(foreign_hdf5_refusal(folder / "a.h5", {"x/y/z"}), "");
}

TEST(ForeignHdf5, DeepGroups_AreOmitted) {
  ATELIER_NEEDS_H5PY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_h5py(folder, "h5py.File('a.h5', 'w').create_group('/'.join(['g'] * 500))"));
  const ForeignHdf5Contents contents = foreign_hdf5_contents(folder / "a.h5");
  ASSERT_EQ(contents.left_out.size(), 1u);
  EXPECT_THAT(contents.left_out.begin()->second, HasSubstr("deeper than 32"));
}

TEST(ForeignHdf5, TooManyNames_AreRefused) {
  ATELIER_NEEDS_H5PY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_h5py(folder, R"(
with h5py.File('a.h5', 'w') as f:
    for i in range(50):
        f.create_group(str(i))
)"));
  Limits limits;
  limits.archive_entries = 40;
  EXPECT_THROW(foreign_hdf5_contents(folder / "a.h5", limits), DataError);
  EXPECT_NO_THROW(foreign_hdf5_contents(folder / "a.h5"));
}

TEST(ForeignHdf5, NonHdf5File_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / "text.h5") << "hello";
  std::ofstream(folder / "empty.h5");
  EXPECT_THAT(foreign_hdf5_refusal(folder / "text.h5", {"x"}), HasSubstr("no HDF5, or damaged"));
  EXPECT_THAT(foreign_hdf5_refusal(folder / "empty.h5", {"x"}), HasSubstr("an empty file"));
  EXPECT_NE(foreign_hdf5_refusal(folder / "missing.h5", {"x"}), "");
  EXPECT_NE(foreign_hdf5_refusal(folder.path(), {"x"}), "");
}

}  // namespace
}  // namespace atelier
