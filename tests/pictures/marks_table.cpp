// The tables of docs/results/marks.md: marks_table TURNS FOLDER...; each folder is a group of
// images (PNG, JPEG), and its name that of the group. Needs ffmpeg for the rows of films.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "core/io/image_file.h"
#include "core/io/lower_extension.h"
#include "core/mark/image_mark.h"
#include "core/random.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Group {
  std::string name;
  std::vector<ByteImage> images;
};

cv::Mat matrix_of(ByteImage& image) {
  return {image.height, image.width, CV_8UC3, image.data.data()};
}

ByteImage image_of(const cv::Mat& matrix) {
  ByteImage image(matrix.cols, matrix.rows, 3);
  matrix.copyTo(matrix_of(image));
  return image;
}

ByteImage scaled(ByteImage image, double factor) {
  cv::Mat result;
  cv::resize(matrix_of(image), result, {}, factor, factor,
             factor < 0.6 ? cv::INTER_AREA : cv::INTER_LINEAR);
  return image_of(result);
}

ByteImage jpeg(const ByteImage& image, int quality) {
  const std::string bytes = image_bytes(image, ImageFormat::Jpeg, {.quality = quality});
  return read_byte_image(std::as_bytes(std::span(bytes)), "attack.jpg");
}

/// Half of the pixels, from anywhere: all rows or all columns are kept.
ByteImage half(ByteImage image, Random& random) {
  const bool columns = image.width > image.height;
  const int width = columns ? image.width / 2 : image.width;
  const int height = columns ? image.height : image.height / 2;
  const int x =
      static_cast<int>(uniform_index(random, static_cast<std::uint64_t>(image.width - width + 1)));
  const int y = static_cast<int>(
      uniform_index(random, static_cast<std::uint64_t>(image.height - height + 1)));
  return image_of(matrix_of(image)(cv::Rect(x, y, width, height)).clone());
}

ByteImage gamma(ByteImage image, double exponent) {
  for (std::uint8_t& value : image.data) {
    value = saturating_cast<std::uint8_t>(
        std::round(255 * std::pow(static_cast<double>(value) / 255, exponent)));
  }
  return image;
}

/// On a larger screen: at another size, at an odd place, with other things round it.
ByteImage screenshot(const ByteImage& image, double size, double exponent, Random& random) {
  ByteImage shown = gamma(scaled(image, size), exponent);
  cv::Mat screen(shown.height + 217, shown.width + 391, CV_8UC3, cv::Scalar(246, 246, 250));
  cv::rectangle(screen, {0, 0, screen.cols, 61}, cv::Scalar(40, 44, 52), cv::FILLED);
  for (int i = 0; i < 20; ++i) {
    const int x =
        static_cast<int>(uniform_index(random, static_cast<std::uint64_t>(screen.cols - 90)));
    cv::rectangle(screen, {x, 12 + 2 * i % 40, 80, 6}, cv::Scalar(200, 120, 90), cv::FILLED);
  }
  matrix_of(shown).copyTo(screen(cv::Rect(151, 103, shown.width, shown.height)));
  return image_of(screen);
}

struct Attack {
  std::string name;
  std::function<ByteImage(const ByteImage&, Random&)> change;
};

std::vector<Attack> attacks() {
  const auto same = [](const ByteImage& image, Random&) { return image; };
  return {
      {"none", same},
      {"JPEG 70", [](const ByteImage& i, Random&) { return jpeg(i, 70); }},
      {"JPEG 50", [](const ByteImage& i, Random&) { return jpeg(i, 50); }},
      {"a third of the size", [](const ByteImage& i, Random&) { return scaled(i, 1.0 / 3); }},
      {"a third, JPEG 70",
       [](const ByteImage& i, Random&) { return jpeg(scaled(i, 1.0 / 3), 70); }},
      {"crop of half", [](const ByteImage& i, Random& r) { return half(i, r); }},
      {"crop of half, JPEG 70", [](const ByteImage& i, Random& r) { return jpeg(half(i, r), 70); }},
      {"crop of a quarter", [](const ByteImage& i, Random& r) { return half(half(i, r), r); }},
      {"gamma 1/1.3", [](const ByteImage& i, Random&) { return gamma(i, 1 / 1.3); }},
      {"gamma 1.3", [](const ByteImage& i, Random&) { return gamma(i, 1.3); }},
      {"screenshot at 0.83, gamma 1.2",
       [](const ByteImage& i, Random& r) { return screenshot(i, 0.83, 1.2, r); }},
      {"screenshot at 0.57, JPEG 70",
       [](const ByteImage& i, Random& r) { return jpeg(screenshot(i, 0.57, 1, r), 70); }},
      {"any size in [0.3, 2]",
       [](const ByteImage& i, Random& r) { return scaled(i, uniform(r, 0.3, 2)); }},
  };
}

constexpr int kFilmFrames = 60;

/// A film of 2 s, 30 frames a second, at 2 Mbit/s, decoded again: what the image shows moves behind
/// the mark. Empty where ffmpeg fails.
std::vector<ByteImage> film_of(const ByteImage& image, const ImageMark& mark,
                               const fs::path& folder) {
  const int width = image.width / 2 * 2;
  const int height = image.height / 2 * 2;
  const std::string raw = (folder / "film.raw").string();
  const std::string film = (folder / "film.mp4").string();
  std::FILE* file = std::fopen(raw.c_str(), "wb");
  for (int f = 0; f < kFilmFrames; ++f) {
    ByteImage frame(width, height, 3);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 3; ++c) {
          frame.at(x, y, c) = image.at(std::max(x - 2 * f, 0), y, c);
        }
      }
    }
    mark.add_to(frame);
    std::fwrite(frame.data.data(), 1, frame.data.size(), file);
  }
  std::fclose(file);
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  const std::string pixels = " -f rawvideo -pix_fmt rgb24 -s " + size + " ";
  const std::string command =
      "ffmpeg -loglevel error -y -r 30" + pixels + "-i " + raw +
      " -c:v libx264 -pix_fmt yuv420p -b:v 2M -maxrate 2M -bufsize 2M -preset medium " + film +
      " && ffmpeg -loglevel error -y -i " + film + pixels + raw;
  std::vector<ByteImage> frames;
  if (std::system(command.c_str()) != 0) {
    return frames;
  }
  file = std::fopen(raw.c_str(), "rb");
  ByteImage frame(width, height, 3);
  while (std::fread(frame.data.data(), 1, frame.data.size(), file) == frame.data.size()) {
    frames.push_back(frame);
  }
  std::fclose(file);
  return frames;
}

struct Row {
  int found = 0;
  int tries = 0;
  double seconds = 0;
};

void look(const ImageOf<float>& brightness, std::uint64_t bits, Row& row, int& wrong) {
  const auto start = Clock::now();
  const auto found = find_mark(brightness).found;
  row.seconds += std::chrono::duration<double>(Clock::now() - start).count();
  ++row.tries;
  row.found += found && found->bits == bits ? 1 : 0;
  wrong += found && found->bits != bits ? 1 : 0;
}

std::uint64_t random_bits(Random& random) {
  return uniform_index(random, std::uint64_t{1} << 32) << 32 |
         uniform_index(random, std::uint64_t{1} << 32);
}

void print_row(const std::string& name, const std::vector<Row>& rows) {
  std::printf("| %s |", name.c_str());
  for (const Row& row : rows) {
    std::printf(" %d of %d, %.2f s |", row.found, row.tries, row.seconds / std::max(1, row.tries));
  }
  std::printf("\n");
  std::fflush(stdout);
}

void print_survival(const std::vector<Group>& groups, int turns, Random& random) {
  int wrong = 0;
  for (const Attack& attack : attacks()) {
    std::vector<Row> rows;
    for (const Group& group : groups) {
      Row& row = rows.emplace_back();
      for (const ByteImage& image : group.images) {
        for (int turn = 0; turn < turns; ++turn) {
          const std::uint64_t bits = random_bits(random);
          ByteImage marked = image;
          ImageMark(bits).add_to(marked);
          look(mark_brightness(attack.change(marked, random)), bits, row, wrong);
        }
      }
    }
    print_row(attack.name, rows);
  }
  const fs::path folder = fs::temp_directory_path() / ("marks" + std::to_string(random.counter));
  fs::create_directories(folder);
  std::vector<Row> one;
  std::vector<Row> mean;
  for (const Group& group : groups) {
    Row& row = one.emplace_back();
    Row& row_of_mean = mean.emplace_back();
    for (const ByteImage& image : group.images) {
      const std::uint64_t bits = random_bits(random);
      const std::vector<ByteImage> frames = film_of(image, ImageMark(bits), folder);
      if (frames.size() != kFilmFrames) {
        continue;
      }
      ImageOf<float> sum(frames[0].width, frames[0].height, 1);
      for (std::size_t f = 2; f < frames.size(); f += 5) {
        const ImageOf<float> frame = mark_brightness(frames[f]);
        for (std::size_t i = 0; i < sum.data.size(); ++i) {
          sum.data[i] += frame.data[i] / 12;
        }
      }
      look(mark_brightness(frames[37]), bits, row, wrong);
      look(sum, bits, row_of_mean, wrong);
    }
  }
  print_row("H.264 at 2 Mbit/s, one frame", one);
  print_row("H.264 at 2 Mbit/s, mean of 12 frames", mean);
  fs::remove_all(folder);
  std::printf("\nWrong marks: %d.\n\n", wrong);
}

void print_visibility(const std::vector<Group>& groups) {
  std::printf(
      "| group | images | PSNR, least and mean | marking an image | its PNG, before and after |\n"
      "|---|---|---|---|---|\n");
  for (const Group& group : groups) {
    double least = 1e9;
    double sum = 0;
    double seconds = 0;
    double encoding[2] = {};
    double bytes[2] = {};
    const auto encode = [&](const ByteImage& image, int which) {
      const auto start = Clock::now();
      bytes[which] += static_cast<double>(image_bytes(image, ImageFormat::Png).size());
      encoding[which] += std::chrono::duration<double>(Clock::now() - start).count();
    };
    for (const ByteImage& image : group.images) {
      const ImageMark mark(0x0123456789abcdef);
      ByteImage marked = image;
      const auto start = Clock::now();
      mark.add_to(marked);
      seconds += std::chrono::duration<double>(Clock::now() - start).count();
      encode(image, 0);
      encode(marked, 1);
      double squares = 0;
      for (std::size_t i = 0; i < image.data.size(); ++i) {
        squares += std::pow(static_cast<double>(image.data[i]) - marked.data[i], 2);
      }
      const double psnr =
          10 * std::log10(255.0 * 255 * static_cast<double>(image.data.size()) / squares);
      least = std::min(least, psnr);
      sum += psnr;
    }
    const auto count = static_cast<double>(group.images.size());
    std::printf("| %s | %zu | %.1f, %.1f dB | %.1f ms | %.0f KB in %.0f ms, %.0f KB in %.0f ms |\n",
                group.name.c_str(), group.images.size(), least, sum / count, 1e3 * seconds / count,
                bytes[0] / count / 1e3, 1e3 * encoding[0] / count, bytes[1] / count / 1e3,
                1e3 * encoding[1] / count);
  }
}

/// What unmarked images decode to: of each checksum every bit is chance.
void print_false_alarms(const std::vector<Group>& groups, int turns, Random& random) {
  int images = 0;
  int found = 0;
  long tried = 0;
  long low = 0;
  long bits = 0;
  for (const Group& group : groups) {
    for (const ByteImage& image : group.images) {
      for (int turn = 0; turn < turns; ++turn) {
        const ByteImage part =
            turn == 0 ? image : scaled(half(image, random), uniform(random, 0.5, 1));
        const MarkSearch search = find_mark(mark_brightness(part));
        ++images;
        found += search.found ? 1 : 0;
        for (const std::uint32_t difference : search.tried) {
          ++tried;
          low += (difference & 0xFF) == 0 ? 1 : 0;
          bits += __builtin_popcount(difference);
        }
      }
    }
  }
  std::printf(
      "%d unmarked images: %d marks found. %ld places decoded: the low 8 bits of the checksum "
      "agree in "
      "%ld (chance: %.1f +- %.1f), and %.3f of all its bits differ.\n\n",
      images, found, tried, low, static_cast<double>(tried) / 256,
      std::sqrt(static_cast<double>(tried) / 256),
      static_cast<double>(bits) / (32.0 * static_cast<double>(tried)));
}

Group read_group(const fs::path& folder) {
  Group group{.name = folder.filename().string(), .images = {}};
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string extension = lower_extension(entry.path());
    if (extension == ".png" || extension == ".jpg") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    ByteImage image = read_byte_image(file);
    if (image.channels == 3) {
      group.images.push_back(std::move(image));
    }
  }
  return group;
}

int run(int turns, const std::vector<std::string>& folders) {
  Random random{.seed = static_cast<std::uint64_t>(
                    std::chrono::system_clock::now().time_since_epoch().count())};
  std::printf("Seed %llu.\n\n", static_cast<unsigned long long>(random.seed));
  std::vector<Group> groups;
  for (const std::string& folder : folders) {
    groups.push_back(read_group(folder));
  }
  print_visibility(groups);
  std::printf("\n| change |");
  for (const Group& group : groups) {
    std::printf(" %s |", group.name.c_str());
  }
  std::printf("\n|---|");
  for (std::size_t i = 0; i < groups.size(); ++i) {
    std::printf("---|");
  }
  std::printf("\n");
  print_survival(groups, turns, random);
  print_false_alarms(groups, 2 * turns, random);
  return 0;
}

}  // namespace
}  // namespace atelier

int main(int count, char** words) {
  if (count < 3) {
    std::fprintf(stderr, "usage: marks_table TURNS FOLDER...\n");
    return 2;
  }
  return atelier::run(std::atoi(words[1]), {words + 2, words + count});
}
