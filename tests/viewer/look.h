#pragma once

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/browser.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"

namespace atelier::fixtures {

/// How many pixels of the view are blue (garments) and warm (skin), as the page counts them.
inline const std::string kCounts = R"((() => {
  atelier.draw();
  const gl = atelier.view.renderer.getContext();
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const p = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, p);
  let blue = 0, warm = 0, yellow = 0;
  for (let i = 0; i < p.length; i += 4) {
    blue += p[i + 2] > p[i] + 25;
    warm += p[i] > p[i + 2] + 25;
    yellow += p[i] > p[i + 2] + 90;
  }
  return {blue: blue / (w * h), warm: warm / (w * h), yellow: yellow / (w * h)};
})())";
/// Step: the share of the view's pixels of which a condition on r, g, b (0 to 255) holds, and on x,
/// their place from the left in [0, 1].
inline std::string share(const std::string& condition) {
  return R"(eval:(() => {
  atelier.draw();
  const gl = atelier.view.renderer.getContext();
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const p = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, p);
  let count = 0;
  for (let i = 0; i < p.length; i += 4) {
    const [r, g, b, x] = [p[i], p[i + 1], p[i + 2], i / 4 % w / w];
    count += )" +
         condition + R"(;
  }
  return count / (w * h);
})())";
}
/// Step: until what was asked for is drawn.
inline const std::string kSettled = "wait:!atelier.loading && !atelier.dirty";

inline ChildResult view(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {program_path(), "view"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_child(command);
}

/// What tests/viewer/look.py prints, a line each.
struct Looked {
  std::vector<nlohmann::json> values;  ///< of its `eval`s
  std::string messages;                ///< what the browser logged
  std::string outside;                 ///< addresses that are not the page's
};

inline Looked look(const std::string& address, std::vector<std::string> steps) {
  std::vector<std::string> command = {
      "python3", (source_directory() / "tests/viewer/look.py").string(), address};
  command.insert(command.end(), steps.begin(), steps.end());
  const ChildResult result = run_child(command);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  Looked looked;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("message: ")) {
      looked.messages += line + "\n";
    } else if (line.starts_with("outside: ")) {
      looked.outside += line + "\n";
    } else {
      looked.values.push_back(nlohmann::json::parse(line));
    }
  }
  return looked;
}

/// What must be there for a test that looks.
inline bool can_look() {
  return has_browser() && run_child({"python3", "-c", ""}).exit_code == 0;
}

#define SKIP_WITHOUT_BROWSER()                                        \
  if (!can_look()) {                                                  \
    GTEST_SKIP() << "no program chromium or python3 (scripts/setup)"; \
  }

}  // namespace atelier::fixtures
