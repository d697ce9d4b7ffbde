#pragma once

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/child_process.h"

namespace atelier::fixtures {

/// What headless Chromium makes of a page.
struct BrowsedPage {
  int images = 0;
  int broken = 0;        ///< of them, those that did not load
  std::string text;      ///< of the page, as it is shown
  std::string messages;  ///< what the browser logs, errors of the page as CONSOLE
};

inline bool has_browser() {
  return run_child({"sh", "-c", "command -v chromium"}).exit_code == 0;
}

/// Opens a page within another one whose script counts its images: the page itself runs none.
inline BrowsedPage browse(const std::filesystem::path& page, const std::filesystem::path& scratch) {
  const std::filesystem::path frame = scratch / "frame.html";
  std::ofstream(frame) << "<iframe id='page' src='file://" << page.string() << R"('></iframe>
<pre id='found'></pre><script>
window.onload = () => {
  const page = document.getElementById('page').contentDocument;
  const images = [...page.images];
  const broken = images.filter(image => !image.complete || image.naturalWidth === 0);
  document.getElementById('found').textContent =
      'found ' + images.length + ' ' + broken.length + ' ' + page.body.innerText;
};
</script>)";
  const ChildResult result =
      run_child({"chromium", "--headless", "--no-sandbox", "--disable-gpu",
                 "--allow-file-access-from-files", "--enable-logging=stderr",
                 "--virtual-time-budget=10000", "--user-data-dir=" + (scratch / "profile").string(),
                 "--dump-dom", "file://" + frame.string()});
  BrowsedPage found;
  const std::string mark = "<pre id=\"found\">found ";
  const std::size_t at = result.out.find(mark);
  if (at != std::string::npos) {
    const std::string counts = result.out.substr(at + mark.size());
    std::sscanf(counts.c_str(), "%d %d", &found.images, &found.broken);
    found.text = counts.substr(0, counts.find("</pre>"));
  }
  found.messages = result.err;
  return found;
}

}  // namespace atelier::fixtures
