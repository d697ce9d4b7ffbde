#include "core/render/drawing.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/render/color_map.h"
#include "core/render/contact_sheet.h"
#include "core/render/tone.h"
#include "tests/core_render/shapes.h"

namespace atelier {
namespace {

using fixtures::color_at;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double ink(const Image& image) {
  double sum = 0;
  for (const float value : image.data) {
    sum += value;
  }
  return sum / image.channels;
}

TEST(Drawing, Disc_CoversItsAreaAroundItsCentre) {
  const Image image = drawn(Image(64, 48, 3), {Circle{{30.25, 20.75}, 10}});
  EXPECT_NEAR(ink(image), std::numbers::pi * 100, 2);
  double x = 0, y = 0;
  for (int j = 0; j < 48; ++j) {
    for (int i = 0; i < 64; ++i) {
      x += image.at(i, j) * (i + 0.5);
      y += image.at(i, j) * (j + 0.5);
    }
  }
  EXPECT_NEAR(x / ink(image), 30.25, 0.1);
  EXPECT_NEAR(y / ink(image), 20.75, 0.1);
}

TEST(Drawing, Ring_LeavesItsMiddleFree) {
  const Image image = drawn(Image(40, 40, 3), {Circle{{20, 20}, 12, {1, 0, 0}, 2}});
  EXPECT_EQ(image.at(20, 20), 0);
  EXPECT_GT(image.at(31, 20, 0), 0.3f);
  EXPECT_EQ(image.at(31, 20, 1), 0);
}

TEST(Drawing, Line_RunsThroughPixelCentres) {
  Polyline line;
  line.points = {{2.5, 5.5}, {17.5, 5.5}};
  line.color = {0, 1, 0};
  line.width = 1;
  const Image image = drawn(Image(20, 10, 3), {line});
  EXPECT_NEAR(image.at(10, 5, 1), 1, 0.02);
  EXPECT_LT(image.at(10, 3, 1), 0.01);
  EXPECT_LT(image.at(10, 7, 1), 0.01);
}

TEST(Drawing, ClosedLine_DrawsTheLastSegment) {
  Polyline line;
  line.points = {{5, 5}, {25, 5}, {25, 25}, {5, 25}};
  const double open = ink(drawn(Image(30, 30, 1), {line}));
  line.closed = true;
  EXPECT_GT(ink(drawn(Image(30, 30, 1), {line})), 1.2 * open);
}

TEST(Drawing, Opacity_BlendsWithTheImage) {
  Circle disc{{10, 10}, 5, {1, 1, 1}};
  disc.opacity = 0.25;
  EXPECT_NEAR(drawn(Image(20, 20, 3, 0.4f), {disc}).at(10, 10), 0.4 + 0.25 * 0.6, 0.01);
}

TEST(Drawing, Alpha_IsSetWhereDrawn) {
  const Image image = drawn(Image(20, 20, 4), {Circle{{10, 10}, 4}});
  EXPECT_EQ(image.at(10, 10, 3), 1);
  EXPECT_EQ(image.at(1, 1, 3), 0);
}

TEST(Drawing, PartsOutsideTheImage_AreClipped) {
  Polyline line;
  line.points = {{-1e9, 10}, {1e9, 10}};
  const Image image = drawn(Image(20, 20, 1), {line, Circle{{-50, -50}, 5}, Text{{300, 5}, "far"}});
  EXPECT_GT(image.at(10, 10), 0.3f);
  EXPECT_EQ(image.at(10, 2), 0);
}

TEST(Drawing, LaterMarks_AreDrawnOnTop) {
  const Image image =
      drawn(Image(20, 20, 3), {Circle{{10, 10}, 6, {1, 0, 0}}, Circle{{10, 10}, 3, {0, 0, 1}}});
  EXPECT_EQ(image.at(10, 10, 0), 0);
  EXPECT_EQ(image.at(10, 10, 2), 1);
  EXPECT_NEAR(image.at(15, 10, 0), 1, 0.05);
}

TEST(Drawing, TextAnchor_SetsItsPosition) {
  const auto first_column = [](const Image& image) {
    for (int x = 0; x < image.width; ++x) {
      for (int y = 0; y < image.height; ++y) {
        if (image.at(x, y) > 0.2f) {
          return x;
        }
      }
    }
    return -1;
  };
  const double width = text_width("HHHH", 14);
  const int left = first_column(drawn(Image(200, 40, 1), {Text{{100, 30}, "HHHH", 14}}));
  Text label{{100, 30}, "HHHH", 14};
  label.anchor = Text::Anchor::Right;
  const int right = first_column(drawn(Image(200, 40, 1), {label}));
  label.anchor = Text::Anchor::Center;
  const int center = first_column(drawn(Image(200, 40, 1), {label}));
  EXPECT_NEAR(left, 100, 4);
  EXPECT_NEAR(left - right, width, 1.5);
  EXPECT_NEAR(left - center, width / 2, 1.5);
}

TEST(Drawing, CapitalLetters_HaveRequestedHeight) {
  const Image image = drawn(Image(100, 100, 1), {Text{{10, 80}, "H", 40}});
  int top = 100, bottom = 0;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) {
      if (image.at(x, y) > 0.5f) {
        top = std::min(top, y);
        bottom = std::max(bottom, y);
      }
    }
  }
  EXPECT_NEAR(bottom - top, 40, 4);
  EXPECT_NEAR(bottom, 80, 3);
}

TEST(Drawing, Halo_DarkensAroundText) {
  Text label{{10, 30}, "H", 20, {1, 1, 1}, Text::Anchor::Left, 2};
  const Image image = drawn(Image(60, 40, 1, 0.5f), {label});
  EXPECT_LT(*std::min_element(image.data.begin(), image.data.end()), 0.2f);
  EXPECT_GT(*std::max_element(image.data.begin(), image.data.end()), 0.9f);
}

TEST(Drawing, UnsupportedCharacters_BecomeQuestionMarks) {
  const Image a = drawn(Image(80, 30, 1), {Text{{5, 22},
                                                "a\xC3\xA9"
                                                "b",
                                                14}});
  const Image b = drawn(Image(80, 30, 1), {Text{{5, 22}, "a?b", 14}});
  EXPECT_EQ(a.data, b.data);
}

TEST(Drawing, NoMarks_ChangeNothing) {
  const Image image(5, 5, 3, 0.3f);
  EXPECT_EQ(drawn(image, {}).data, image.data);
  EXPECT_EQ(drawn(image, {Polyline{}, Text{}}).data, image.data);
  EXPECT_EQ(drawn(Image(0, 0, 3), {Circle{}}).data.size(), 0u);
}

TEST(DrawingRefusal, UnsupportedChannels_Throw) {
  EXPECT_THROW(drawn(Image(4, 4, 2), {}), LogicError);
}

TEST(DrawingRefusal, NonFiniteOrNonPositiveNumbers_Throw) {
  Polyline line;
  line.points = {{0, 0}, {kNan, 1}};
  EXPECT_THROW(drawn(Image(4, 4, 3), {line}), LogicError);
  EXPECT_THROW(drawn(Image(4, 4, 3), {Circle{{kNan, 0}}}), LogicError);
  EXPECT_THROW(drawn(Image(4, 4, 3), {Circle{{1, 1}, -1}}), LogicError);
  EXPECT_THROW(drawn(Image(4, 4, 3), {Text{{0, kNan}, "x"}}), LogicError);
  EXPECT_THROW(drawn(Image(4, 4, 3), {Text{{0, 0}, "x", 0}}), LogicError);
}

TEST(ColorMaps, EndsAndOutOfRangeValues_MapAsExpected) {
  EXPECT_GT(map_color(ColorMap::Viridis, 1).y(), map_color(ColorMap::Viridis, 0).y());
  EXPECT_NEAR(map_color(ColorMap::Diverging, 0.5).x(), map_color(ColorMap::Diverging, 0.5).z(),
              1e-6);
  EXPECT_GT(map_color(ColorMap::Diverging, 0).z(), map_color(ColorMap::Diverging, 0).x());
  EXPECT_GT(map_color(ColorMap::Diverging, 1).x(), map_color(ColorMap::Diverging, 1).z());
  for (const ColorMap map : {ColorMap::Viridis, ColorMap::Turbo, ColorMap::Diverging}) {
    EXPECT_EQ(map_color(map, -5), map_color(map, 0));
    EXPECT_EQ(map_color(map, 7), map_color(map, 1));
    EXPECT_EQ(map_color(map, kNan), Eigen::Vector3f(0.3f, 0.3f, 0.3f));
  }
}

TEST(ColorMaps, Viridis_BrightensMonotonically) {
  double last = -1;
  for (int i = 0; i <= 20; ++i) {
    const Eigen::Vector3f c = map_color(ColorMap::Viridis, i / 20.0);
    const double brightness = 0.2126 * c.x() + 0.7152 * c.y() + 0.0722 * c.z();
    EXPECT_GT(brightness, last);
    last = brightness;
  }
}

TEST(ColorMaps, Values_AreScaledToTheRange) {
  const Colors colors = map_colors(ColorMap::Viridis, Eigen::Vector3d(-2, 0, 2), -2, 2);
  EXPECT_EQ(Eigen::Vector3f(colors.row(0)), map_color(ColorMap::Viridis, 0));
  EXPECT_EQ(Eigen::Vector3f(colors.row(1)), map_color(ColorMap::Viridis, 0.5));
  EXPECT_EQ(Eigen::Vector3f(colors.row(2)), map_color(ColorMap::Viridis, 1));
}

TEST(ColorMaps, ColorBar_ShowsTheMapUpright) {
  const Image bar = color_bar(ColorMap::Viridis, 0, 12.5, "strain / %", 300);
  fixtures::keep_picture("color_bar", bar);
  EXPECT_EQ(bar.height, 300);
  EXPECT_LT((color_at(bar, 20, 286) - map_color(ColorMap::Viridis, 0)).norm(), 0.02f);
  EXPECT_LT((color_at(bar, 20, 38) - map_color(ColorMap::Viridis, 1)).norm(), 0.02f);
}

TEST(ColorMapRefusal, EmptyRange_Throws) {
  EXPECT_THROW(map_colors(ColorMap::Viridis, Eigen::VectorXd::Zero(3), 1, 1), LogicError);
  EXPECT_THROW(color_bar(ColorMap::Viridis, 2, 1, ""), LogicError);
  EXPECT_THROW(color_bar(ColorMap::Viridis, kNan, 1, ""), LogicError);
  EXPECT_THROW(color_bar(ColorMap::Viridis, 0, 1, "", 10), LogicError);
}

TEST(ContactSheet, Images_AreLaidOutOnTheGrid) {
  std::vector<CaptionedImage> pictures;
  for (int i = 0; i < 5; ++i) {
    pictures.push_back({Image(20, 10, 3, 0.1f * static_cast<float>(i + 1)), ""});
  }
  ContactSheetOptions options;
  options.columns = 3;
  options.gap = 4;
  const Image sheet = contact_sheet(pictures, options);
  EXPECT_EQ(sheet.width, 4 + 3 * 24);
  EXPECT_EQ(sheet.height, 4 + 2 * 14);
  EXPECT_NEAR(sheet.at(4 + 24 + 10, 4 + 5), 0.2, 1e-6);
  EXPECT_NEAR(sheet.at(4 + 24 + 10, 4 + 14 + 5), 0.5, 1e-6);
  EXPECT_NEAR(sheet.at(4 + 48 + 10, 4 + 14 + 5), 0.93, 1e-6) << "no sixth image";
}

TEST(ContactSheet, SmallAndGrayImages_AreCentred) {
  const Image sheet = contact_sheet({{Image(20, 20, 3, 0.5f), "a"}, {Image(10, 10, 1, 0.25f), "b"}},
                                    {.columns = 2, .gap = 2});
  EXPECT_NEAR(sheet.at(24 + 10, 2 + 10, 2), 0.25, 1e-6);
  EXPECT_NEAR(sheet.at(24 + 2, 2 + 10), 0.93, 1e-6);
}

TEST(ContactSheet, UnevenRows_FitTheirContent) {
  const ContactSheetOptions options{.columns = 1, .even_rows = false, .gap = 2};
  const Image tall(20, 50, 3, 0.5f);
  const Image flat(20, 10, 3, 0.25f);
  const Image sheet = contact_sheet({{tall, ""}, {flat, ""}, {flat, ""}}, options);
  EXPECT_EQ(sheet.height, 2 + 52 + 12 + 12);
  EXPECT_NEAR(sheet.at(12, 2 + 52 + 5), 0.25, 1e-6);
  EXPECT_NEAR(sheet.at(12, 2 + 52 + 12 + 5), 0.25, 1e-6);
  const int line = contact_sheet({{tall, ""}, {flat, "x"}}, options).height - (2 + 52 + 12);
  EXPECT_GT(line, 0) << "under the row alone that has a caption";
  EXPECT_EQ(contact_sheet({{tall, "x"}, {flat, "x"}}, options).height, 2 + 52 + 12 + 2 * line);
  EXPECT_EQ(contact_sheet({{tall, ""}, {flat, ""}}, {.columns = 1, .gap = 2}).height, 2 + 2 * 52);
}

TEST(ContactSheet, FixedCellWidth_ScalesImagesAndCutsCaptions) {
  const Image sheet = contact_sheet(
      {{Image(100, 50, 3, 0.5f), "a caption that is much too long for so narrow a cell"},
       {Image(300, 300, 3, 0.2f), "short"}},
      {.columns = 2, .cell_width = 80, .gap = 5, .title = "Title"});
  fixtures::keep_picture("contact_sheet", sheet);
  EXPECT_EQ(sheet.width, 5 + 2 * 85);
}

TEST(ContactSheet, CaptionLines_AreStacked) {
  const ContactSheetOptions options{.columns = 2, .gap = 2};
  const auto sheet = [&](const std::string& caption) {
    return contact_sheet({{Image(60, 20, 3, 0.5f), caption}, {Image(60, 20, 3, 0.5f), "x"}},
                         options);
  };
  const Image one = sheet("x");
  const Image two = sheet("x\nx");
  const int line = one.height - (20 + 2 * 2);
  EXPECT_EQ(two.height, one.height + line);
  // The same letter, a line below.
  for (int y = 22; y < 22 + line; ++y) {
    for (int x = 2; x < 62; ++x) {
      ASSERT_EQ(two.at(x, y + line), one.at(x, y)) << x << ' ' << y;
    }
  }
}

TEST(ContactSheet, DefaultColumns_MakeASquareSheet) {
  const std::vector<CaptionedImage> pictures(9, {Image(30, 30, 3), ""});
  const Image sheet = contact_sheet(pictures);
  EXPECT_EQ(sheet.width, sheet.height);
}

TEST(ContactSheetRefusal, BadImagesOrOptions_Throw) {
  EXPECT_THROW(contact_sheet({}), LogicError);
  EXPECT_THROW(contact_sheet({{Image(), ""}}), LogicError);
  EXPECT_THROW(contact_sheet({{Image(4, 4, 2), ""}}), LogicError);
  EXPECT_THROW(contact_sheet({{Image(4, 4, 3), ""}}, {.columns = -1}), LogicError);
  EXPECT_THROW(contact_sheet({{Image(4, 4, 3), ""}}, {.gap = 5000}), LogicError);
  EXPECT_THROW(contact_sheet({{Image(4, 4, 3), ""}}, {.text_height = 0}), LogicError);
}

TEST(Resized, Downsampling_KeepsTheMean) {
  Image image(40, 30, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<float>(i % 7);
  }
  const Image small = resized(image, 10, 10);
  double a = 0, b = 0;
  for (const float value : image.data) {
    a += value;
  }
  for (const float value : small.data) {
    b += value;
  }
  EXPECT_NEAR(a / static_cast<double>(image.data.size()),
              b / static_cast<double>(small.data.size()), 1e-4);
  EXPECT_EQ(resized(image, 40, 30).data, image.data);
  EXPECT_THROW(resized(image, 0, 10), LogicError);
  EXPECT_THROW(resized(Image(), 10, 10), LogicError);
}

TEST(Tone, MidTones_StayAndHighlightsDoNotClip) {
  Image image(6, 1, 1);
  image.data = {0, 0.2f, 0.6f, 0.7f, 1, 50};
  const Image toned = tone_mapped(image);
  EXPECT_EQ(toned.data[0], 0);
  EXPECT_FLOAT_EQ(toned.data[1], 0.2f);
  EXPECT_FLOAT_EQ(toned.data[2], 0.6f);
  EXPECT_NEAR(toned.data[3], 0.7, 0.015) << "the slope is smooth at the shoulder";
  for (std::size_t i = 1; i < 6; ++i) {
    EXPECT_GT(toned.data[i], toned.data[i - 1]);
    EXPECT_LE(toned.data[i], 1);
  }
}

TEST(Tone, Exposure_ScalesColorsNotAlpha) {
  Image image(1, 1, 4, 0.1f);
  image.data[3] = 0.9f;
  const Image toned = tone_mapped(image, {.exposure = 3});
  EXPECT_FLOAT_EQ(toned.data[0], 0.3f);
  EXPECT_FLOAT_EQ(toned.data[3], 0.9f);
}

TEST(Tone, Dither_KeepsTheMeanWithinOneStep) {
  for (const float level : {0.001f, 0.1f, 0.4f}) {
    const Image toned = tone_mapped(Image(100, 100, 1, level), {.dither = 1});
    const ByteImage plain = srgb_from_linear(Image(1, 1, 1, level));
    double sum = 0;
    bool above = false, below = false;
    for (const float value : toned.data) {
      sum += value;
      above = above || value > level;
      below = below || value < level;
    }
    for (const std::uint8_t byte : srgb_from_linear(toned).data) {
      ASSERT_LE(std::abs(byte - plain.data[0]), 1);
    }
    EXPECT_TRUE(above && below);
    EXPECT_NEAR(sum / 10'000, level, 0.0005 * level + 1e-5);
  }
}

TEST(ToneRefusal, OptionOutOfRange_Throws) {
  EXPECT_THROW(tone_mapped(Image(1, 1, 3), {.exposure = 0}), LogicError);
  EXPECT_THROW(tone_mapped(Image(1, 1, 3), {.exposure = kNan}), LogicError);
  EXPECT_THROW(tone_mapped(Image(1, 1, 3), {.shoulder = 1}), LogicError);
  EXPECT_THROW(tone_mapped(Image(1, 1, 3), {.dither = -1}), LogicError);
}

}  // namespace
}  // namespace atelier
