#include "core/render/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "core/error.h"
#include "core/render/drawing.h"
#include "core/saturating_cast.h"

namespace atelier {

namespace {

std::string fitted(const std::string& text, double height, double width) {
  if (text_width(text, height) <= width) {
    return text;
  }
  std::string cut = text;
  while (!cut.empty() && text_width(cut + "...", height) > width) {
    cut.pop_back();
  }
  return cut + "...";
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
  }
  return lines;
}

void paste(Image& sheet, const Image& picture, int x0, int y0) {
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        sheet.at(x0 + x, y0 + y, c) = picture.at(x, y, picture.channels == 1 ? 0 : c);
      }
    }
  }
}

}  // namespace

Image resized(const Image& image, int width, int height) {
  ATELIER_CHECK(image.width > 0 && image.height > 0 && width > 0 && height > 0,
                "resizing needs pixels on both sides");
  Image result(width, height, image.channels);
  const cv::Mat from(image.height, image.width, CV_32FC(image.channels),
                     const_cast<float*>(image.data.data()));
  cv::Mat to(height, width, CV_32FC(image.channels), result.data.data());
  const bool smaller = width < image.width || height < image.height;
  cv::resize(from, to, to.size(), 0, 0, smaller ? cv::INTER_AREA : cv::INTER_LINEAR);
  return result;
}

Image contact_sheet(const std::vector<CaptionedImage>& pictures,
                    const ContactSheetOptions& options) {
  ATELIER_CHECK(!pictures.empty(), "a contact sheet needs at least one image");
  ATELIER_CHECK(options.columns >= 0 && options.cell_width >= 0 && options.gap >= 0 &&
                    options.gap <= 1000 && options.text_height > 0 && options.text_height <= 200,
                "contact sheet options out of range");
  std::vector<Image> cells;
  int cell_width = 1;
  int cell_height = 1;
  for (const CaptionedImage& picture : pictures) {
    ATELIER_CHECK(picture.image.channels == 1 || picture.image.channels == 3,
                  "a contact sheet takes images of 1 or 3 channels");
    ATELIER_CHECK(picture.image.width > 0 && picture.image.height > 0,
                  "a contact sheet takes no empty images");
    if (options.cell_width > 0) {
      const double scale = static_cast<double>(options.cell_width) / picture.image.width;
      cells.push_back(
          resized(picture.image, options.cell_width,
                  std::max(1, saturating_cast<int>(std::round(picture.image.height * scale)))));
    } else {
      cells.push_back(picture.image);
    }
    cell_width = std::max(cell_width, cells.back().width);
    cell_height = std::max(cell_height, cells.back().height);
  }
  const int count = static_cast<int>(cells.size());
  const int columns = options.columns > 0
                          ? std::min(options.columns, count)
                          : saturating_cast<int>(std::ceil(
                                std::sqrt(static_cast<double>(count) * cell_height / cell_width)));
  const int used = std::clamp(columns, 1, count);
  const int rows = (count + used - 1) / used;
  const int line = saturating_cast<int>(std::ceil(2.2 * options.text_height));
  const int title =
      options.title.empty() ? 0 : saturating_cast<int>(std::ceil(3.2 * options.text_height));
  struct Row {
    int top = 0;
    int picture = 1;  // the tallest one's height
    int caption = 0;
  };
  std::vector<Row> all(static_cast<std::size_t>(rows));
  for (int i = 0; i < count; ++i) {
    Row& row = all[static_cast<std::size_t>(i / used)];
    const auto at = static_cast<std::size_t>(i);
    row.picture = std::max(row.picture, cells[at].height);
    row.caption =
        std::max(row.caption, static_cast<int>(lines_of(pictures[at].caption).size()) * line);
  }
  if (options.even_rows) {
    const auto most = [&](int Row::*of) {
      return (*std::max_element(all.begin(), all.end(),
                                [&](const Row& a, const Row& b) { return a.*of < b.*of; })).*
             of;
    };
    const Row even{0, most(&Row::picture), most(&Row::caption)};
    std::fill(all.begin(), all.end(), even);
  }
  int below_rows = options.gap + title;
  for (Row& row : all) {
    row.top = below_rows;
    below_rows += row.picture + row.caption + options.gap;
  }
  Image sheet(options.gap + used * (cell_width + options.gap), below_rows, 3);
  for (std::size_t i = 0; i < sheet.data.size(); ++i) {
    sheet.data[i] = options.paper[static_cast<int>(i % 3)];
  }
  std::vector<Mark> marks;
  if (title > 0) {
    const double height = 1.5 * options.text_height;
    marks.push_back(Text{{static_cast<double>(options.gap), options.gap + height},
                         fitted(options.title, height, sheet.width - 2.0 * options.gap),
                         height,
                         options.ink,
                         Text::Anchor::Left,
                         0});
  }
  for (int i = 0; i < count; ++i) {
    const Image& cell = cells[static_cast<std::size_t>(i)];
    const int x = options.gap + (i % used) * (cell_width + options.gap);
    const Row& row = all[static_cast<std::size_t>(i / used)];
    paste(sheet, cell, x + (cell_width - cell.width) / 2,
          row.top + (row.picture - cell.height) / 2);
    double below = row.top + row.picture + 1.6 * options.text_height;
    for (const std::string& text : lines_of(pictures[static_cast<std::size_t>(i)].caption)) {
      marks.push_back(Text{{x + 0.5 * cell_width, below},
                           fitted(text, options.text_height, cell_width),
                           options.text_height,
                           options.ink,
                           Text::Anchor::Center,
                           0});
      below += line;
    }
  }
  return drawn(std::move(sheet), marks);
}

}  // namespace atelier
