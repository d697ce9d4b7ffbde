// cameras.json: what is written reads back to the bit, what is malformed is refused.

#include "core/io/cameras_file.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/core_io/few_cameras.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using fixtures::few_cameras;

std::string with_replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(CamerasFile, WrittenCameras_ReadBackBitExact) {
  const std::vector<Camera> cameras = few_cameras(6);
  const std::vector<Camera> back = parse_cameras_json(cameras_json(cameras));
  ASSERT_EQ(back.size(), cameras.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].id, cameras[i].id);
    EXPECT_EQ(back[i].fx, cameras[i].fx);
    EXPECT_EQ(back[i].distortion, cameras[i].distortion);
    EXPECT_EQ(back[i].camera_from_world_rotation, cameras[i].camera_from_world_rotation);
    EXPECT_EQ(back[i].camera_from_world_translation, cameras[i].camera_from_world_translation);
    EXPECT_EQ(back[i].gain, cameras[i].gain);
  }
}

TEST(CamerasFile, MalformedFile_IsRefused) {
  const std::string good = cameras_json(few_cameras(2));
  const auto refused = [&](const std::string& from, const std::string& to, const char* words) {
    ATELIER_EXPECT_REFUSED(parse_cameras_json(with_replaced(good, from, to), "cameras.json"),
                           DataError, words);
  };
  refused("\"pixel_origin\": \"corner\"", "\"pixel_origin\": \"centre\"", "pixel_origin");
  refused("\"id\": \"01\"", "\"id\": \"00\"", "each id once");
  refused("\"id\": \"01\"", "\"id\": \"a/b\"", "letters");
  refused("\"brown\"", "\"polynomial\"", "brown");
  refused("\"width\": 800", "\"width\": 0", "width");
  refused("\"fx\":", "\"f\":", "fx");
  ATELIER_EXPECT_REFUSED(parse_cameras_json("[]", "cameras.json"), DataError, "cameras.json");
  ATELIER_EXPECT_REFUSED(cameras_json({}), DataError, "at least one camera");
}

}  // namespace
}  // namespace atelier
