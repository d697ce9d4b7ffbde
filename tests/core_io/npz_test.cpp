#include "core/io/npz.h"

#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/npy.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// NumPy of the system in a child process, as the outside judge; false where there is none.
bool run_numpy(const std::string& code) {
  return std::system(
             ("/usr/bin/python3 -c \"import numpy as np\n" + code + "\" 2>/dev/null").c_str()) == 0;
}
#define ATELIER_NEEDS_NUMPY() \
  if (!run_numpy("pass")) GTEST_SKIP() << "no NumPy (python3-numpy)"

template <class Call>
std::string npz_refusal(const Call& call) {
  try {
    call();
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(Npy, WrittenArray_ReadsBackEqual) {
  const Tensor tensor = tensor_of(std::vector<double>{1, 2, 3, 4, 5, 6}, {2, 3});
  const Tensor again = parse_npy(npy_bytes(tensor));
  EXPECT_EQ(again.type, tensor.type);
  EXPECT_EQ(again.shape, tensor.shape);
  EXPECT_EQ(again.data, tensor.data);
}

TEST(Npy, Data_StartsAtMultipleOf64Bytes) {
  for (const std::int64_t n : {0, 1, 12345678}) {
    const Tensor tensor{ElementType::Bool, {0, n}, {}, {}};
    EXPECT_EQ(npy_bytes(tensor).size() % 64, 0u);
  }
}

TEST(Npy, ScalarsAndEmptyArrays_RoundTrip) {
  const Tensor scalar = tensor_of(std::vector<float>{2.5f}, {});
  EXPECT_EQ(doubles_of(parse_npy(npy_bytes(scalar)))[0], 2.5);
  EXPECT_TRUE(parse_npy(npy_bytes(scalar)).shape.empty());
  const Tensor empty{ElementType::Float64, {0, 3}, {}, {}};
  EXPECT_THAT(parse_npy(npy_bytes(empty)).shape, ElementsAre(0, 3));
}

TEST(Npy, Text_RoundTripsAsUnicode) {
  const Tensor tensor{ElementType::Text, {3}, {}, {"female", "", "\xC3\xA9\xF0\x9F\x98\x80"}};
  EXPECT_THAT(parse_npy(npy_bytes(tensor)).strings,
              ElementsAre("female", "", "\xC3\xA9\xF0\x9F\x98\x80"));
  for (const std::string& text : {std::string("\xC3"), std::string("a\0b", 3)}) {
    EXPECT_THROW(npy_bytes(Tensor{ElementType::Text, {1}, {}, {text}}), LogicError);
  }
  EXPECT_THROW(npy_bytes(Tensor{ElementType::BFloat16, {0}, {}, {}}), LogicError);
}

TEST(Npy, OneByteMoreOrLess_IsRefused) {
  std::vector<std::byte> bytes = npy_bytes(tensor_of(std::vector<float>{1, 2}));
  bytes.push_back(std::byte{0});
  EXPECT_THAT(npz_refusal([&] { parse_npy(bytes, "a.npy"); }), HasSubstr("9 bytes of data"));
  bytes.resize(bytes.size() - 2);
  EXPECT_THAT(npz_refusal([&] { parse_npy(bytes, "a.npy"); }), HasSubstr("7 bytes of data"));
}

TEST(Npy, EveryNumpyType_IsRead) {
  ATELIER_NEEDS_NUMPY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_numpy(
      "a = (np.arange(24).reshape(2,3,4) % 2)\n"
      "for t in ['?','i1','i2','i4','i8','u1','u2','u4','u8','f2','f4','f8','c8','c16','>i2',"
      "'>u4','>i8','>f2','>f4','>f8','>c8','>c16']:\n"
      "  for order in 'CF':\n"
      "    n = t.replace('>','be').replace('?','b1')\n"
      "    np.save('" +
      folder.path().string() +
      "/' + n + order + '.npy', "
      "np.array(a, dtype=t, order=order))\n"));
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    const Tensor tensor = read_npy(entry.path());
    EXPECT_THAT(tensor.shape, ElementsAre(2, 3, 4)) << entry.path();
    Tensor real = tensor;
    if (tensor.type == ElementType::Complex64 || tensor.type == ElementType::Complex128) {
      real.type =
          tensor.type == ElementType::Complex64 ? ElementType::Float32 : ElementType::Float64;
      real.shape = {24, 2};
    }
    const std::vector<double> values = doubles_of(real);
    const std::size_t step = values.size() / 24;
    for (std::size_t i = 0; i < 24; ++i) {
      ASSERT_EQ(values[i * step], static_cast<double>(i % 2)) << entry.path() << " " << i;
    }
    ++count;
  }
  EXPECT_EQ(count, 44u);
}

TEST(Npy, FortranOrder_IsReadRowMajor) {
  ATELIER_NEEDS_NUMPY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_numpy("np.save('" + (folder / "a.npy").string() +
                        "', np.asfortranarray(np.arange(210).reshape(2,3,5,7)))"));
  const std::vector<std::int64_t> values = integers_of(read_npy(folder / "a.npy"));
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSERT_EQ(values[i], static_cast<std::int64_t>(i));
  }
}

TEST(Npy, NumpyStrings_AreRead) {
  ATELIER_NEEDS_NUMPY();
  const fixtures::TemporaryDirectory folder;
  const std::string root = folder.path().string();
  ASSERT_TRUE(run_numpy("np.save('" + root +
                        "/u.npy', np.array(['female', chr(0xe9)+chr(0x1f600)]))\n"
                        "np.save('" +
                        root +
                        "/s.npy', np.array(b'male'))\n"
                        "np.save('" +
                        root + "/b.npy', np.array(['xy'], dtype='>U5'))\n"));
  EXPECT_THAT(read_npy(folder / "u.npy").strings,
              ElementsAre("female", "\xC3\xA9\xF0\x9F\x98\x80"));
  EXPECT_THAT(read_npy(folder / "s.npy").strings, ElementsAre("male"));
  EXPECT_THAT(read_npy(folder / "b.npy").strings, ElementsAre("xy"));
}

TEST(Npy, WrittenNames_AreFoundByStrInNumpy) {
  ATELIER_NEEDS_NUMPY();
  const fixtures::TemporaryDirectory folder;
  write_npz(folder / "a.npz",
            {{"names", Tensor{ElementType::Text, {3}, {}, {"spine", "pelvis", "\xC3\xA9"}}}});
  EXPECT_TRUE(run_numpy("names = np.load('" + (folder / "a.npz").string() +
                        "')['names']\nassert list(names).index('pelvis') == 1\n"
                        "assert names[2] == chr(0xe9)"));
}

TEST(Npy, WrittenNpz_IsReadByNumpy) {
  ATELIER_NEEDS_NUMPY();
  const fixtures::TemporaryDirectory folder;
  write_npz(folder / "a.npz",
            {{"points", tensor_of(std::vector<double>{1, 2, 3, 4, 5, 6}, {2, 3})},
             {"faces", tensor_of(std::vector<int>{7, 8, 9}, {1, 3})},
             {"scalar", tensor_of(std::vector<float>{0.25f}, {})},
             {"gender", Tensor{ElementType::Text, {}, {}, {"female"}}},
             {"flags", Tensor{ElementType::Bool, {2}, {std::byte{1}, std::byte{0}}, {}}}});
  EXPECT_TRUE(run_numpy("z = np.load('" + (folder / "a.npz").string() +
                        "', allow_pickle=False)\n"
                        "assert (z['points'] == np.arange(1,7).reshape(2,3)).all()\n"
                        "assert z['faces'].dtype == np.int32 and z['faces'][0,2] == 9\n"
                        "assert z['scalar'] == 0.25 and z['scalar'].shape == ()\n"
                        "assert z['gender'].astype(str) == 'female'\n"
                        "assert z['flags'].tolist() == [True, False]\n"));
}

TEST(Npz, WrittenArchive_ReadsBackEqual) {
  for (const bool deflate : {false, true}) {
    const std::vector<std::byte> bytes = npz_bytes(
        {{"b", tensor_of(std::vector<float>{1, 2})}, {"a", tensor_of(std::vector<int>(1000, 3))}},
        deflate);
    const Npz npz(bytes, "a.npz");
    EXPECT_THAT(npz.names(), ElementsAre("a", "b"));
    EXPECT_TRUE(npz.contains("a"));
    EXPECT_FALSE(npz.contains("c"));
    EXPECT_EQ(integers_of(npz.read("a")), std::vector<std::int64_t>(1000, 3));
    EXPECT_THAT(doubles_of(npz.read("b")), ElementsAre(1, 2));
    EXPECT_EQ(bytes.size() < 2000, deflate);
  }
}

TEST(Npz, SameArrays_GiveIdenticalBytes) {
  const std::map<std::string, Tensor> arrays = {{"a", tensor_of(std::vector<int>{1, 2, 3})}};
  EXPECT_EQ(npz_bytes(arrays), npz_bytes(arrays));
}

TEST(Npz, NumpyZip64AndDeflate_AreRead) {
  ATELIER_NEEDS_NUMPY();
  const fixtures::TemporaryDirectory folder;
  const std::string root = folder.path().string();
  ASSERT_TRUE(
      run_numpy("a = dict(poses=np.arange(12.).reshape(4,3), gender='female', "
                "mocap_framerate=120.0)\n"
                "np.savez('" +
                root +
                "/stored.npz', **a)\n"
                "np.savez_compressed('" +
                root + "/deflated.npz', **a)\n"));
  for (const char* name : {"stored.npz", "deflated.npz"}) {
    const Npz npz(folder / name);
    EXPECT_THAT(npz.names(), ElementsAre("poses", "gender", "mocap_framerate")) << name;
    EXPECT_EQ(matrix_of(npz.read("poses"), 3)(3, 2), 11);
    EXPECT_EQ(npz.read("gender").strings[0], "female");
    EXPECT_EQ(doubles_of(npz.read("mocap_framerate"))[0], 120);
  }
}

TEST(Npz, MissingArray_IsRefusedListingNames) {
  const Npz npz(npz_bytes({{"poses", tensor_of(std::vector<int>{1})}}), "amass.npz");
  const std::string what = npz_refusal([&] { npz.read("betas"); });
  EXPECT_THAT(what, HasSubstr("amass.npz: no array \"betas\""));
  EXPECT_THAT(what, HasSubstr("one of: poses"));
}

TEST(Npz, ObjectArray_IsRefusedByName) {
  ATELIER_NEEDS_NUMPY();
  const fixtures::TemporaryDirectory folder;
  ASSERT_TRUE(run_numpy("np.savez('" + (folder / "a.npz").string() +
                        "', x=np.array([{}], dtype=object), y=np.zeros(2))"));
  const Npz npz(folder / "a.npz");
  EXPECT_THAT(npz_refusal([&] { npz.read("x"); }), HasSubstr("an array of Python objects"));
  EXPECT_EQ(doubles_of(npz.read("y")).size(), 2u);  // the others can still be read
}

TEST(Npz, ZipBomb_IsRefusedBeforeInflating) {
  const std::vector<std::byte> bytes =
      npz_bytes({{"bomb", tensor_of(std::vector<double>(2'000'000))}});
  Limits limits;
  limits.inflate_free_bytes = 1 << 20;
  EXPECT_THAT(npz_refusal([&] { Npz(bytes, "a", limits).read("bomb"); }),
              HasSubstr("at most 1000 times the stored bytes"));
  EXPECT_EQ(npz_refusal([&] { Npz(bytes, "a").read("bomb"); }), "");
  limits = {};
  limits.tensor_bytes = 1 << 20;
  EXPECT_THAT(npz_refusal([&] { Npz(bytes, "a", limits).read("bomb"); }),
              HasSubstr("at most 1048576"));
}

TEST(Npz, TooManyMembers_AreRefused) {
  Limits limits;
  limits.archive_entries = 1;
  const std::vector<std::byte> bytes =
      npz_bytes({{"a", tensor_of(std::vector<int>{1})}, {"b", tensor_of(std::vector<int>{1})}});
  EXPECT_THAT(npz_refusal([&] { Npz(bytes, "a", limits); }), HasSubstr("2 members"));
}

TEST(Npz, DamageInMember_IsFoundByChecksum) {
  std::vector<std::byte> bytes = npz_bytes({{"a", tensor_of(std::vector<int>(50, 7))}}, false);
  bytes[250] ^= std::byte{1};
  EXPECT_THAT(npz_refusal([&] { Npz(bytes, "x").read("a"); }), HasSubstr("CRC"));
}

TEST(Npz, MissingFileOrNonZip_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  EXPECT_THROW(Npz(folder / "missing.npz"), DataError);
  EXPECT_THROW(Npz(folder.path()), DataError);
  std::ofstream(folder / "text.npz") << "hello";
  EXPECT_THAT(npz_refusal([&] { Npz(folder / "text.npz"); }), HasSubstr("no readable zip"));
}

}  // namespace
}  // namespace atelier
