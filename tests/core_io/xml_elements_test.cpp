#include "core/io/xml_elements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

std::vector<std::string> texts_of(const std::string& xml) {
  std::vector<std::string> texts;
  for (const XmlElement& element : parse_xml_elements(xml)) {
    texts.push_back(element.text);
  }
  return texts;
}

TEST(XmlElements, Text_IsWhatStandsBeforeTheFirstChild) {
  EXPECT_THAT(texts_of("<a> one \n<b/>two<c>x &lt; y</c><d></d></a>"),
              ::testing::ElementsAre("one", "", "x < y", ""));
}

TEST(XmlElements, CommentsAndText_AreNotMixed) {
  EXPECT_THAT(texts_of("<a><!-- said -->one</a>"), ::testing::ElementsAre(""));
  EXPECT_THAT(texts_of("<a>one<!-- said -->two</a>"), ::testing::ElementsAre("one"));
}

}  // namespace
}  // namespace atelier
