#include "core/parallel.h"

#include <atomic>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/loop_check.h"
#include "core/random.h"

namespace atelier {
namespace {

TEST(Parallel, ParallelFor_VisitsEveryIndexOnce) {
  for (const int threads : {1, 2, 7}) {
    set_thread_count(threads);
    std::vector<std::atomic<int>> visits(1003);
    parallel_for(1003, 10, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        ++visits[static_cast<std::size_t>(i)];
      }
    });
    for (const auto& count : visits) {
      EXPECT_EQ(count, 1);
    }
  }
  set_thread_count(0);
}

TEST(Parallel, Sum_IsBitIdenticalForAnyThreadCount) {
  std::vector<double> values(10007);
  Random random{.seed = 3};
  for (double& value : values) {
    value = normal(random) * 1e6;
  }
  const auto sum = [&] {
    return parallel_sum(static_cast<Index>(values.size()), 64, 0.0, [&](Index begin, Index end) {
      return std::accumulate(values.begin() + begin, values.begin() + end, 0.0);
    });
  };
  set_thread_count(1);
  const double expected = sum();
  for (const int threads : {2, 7, 16}) {
    set_thread_count(threads);
    EXPECT_EQ(sum(), expected);
  }
  set_thread_count(0);
}

TEST(Parallel, EmptyLoop_DoesNothing) {
  int calls = 0;
  parallel_for(0, 4, [&](Index, Index) { ++calls; });
  parallel_for(-3, 4, [&](Index, Index) { ++calls; });
  EXPECT_EQ(calls, 0);
  EXPECT_EQ(parallel_sum(0, 4, 1.5, [](Index, Index) { return 2.0; }), 1.5);
}

TEST(Parallel, SeveralExceptions_RethrowFirstByChunkOrder) {
  for (int repeat = 0; repeat < 20; ++repeat) {
    try {
      parallel_for(100, 1, [](Index begin, Index) {
        if (begin % 10 == 3) {
          throw std::runtime_error(std::to_string(begin));
        }
      });
      FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "3");
    }
  }
}

TEST(ParallelRefused, BadGrainOrThreadCount_Throws) {
  EXPECT_THROW(parallel_for(10, 0, [](Index, Index) {}), LogicError);
  EXPECT_THROW(set_thread_count(-1), LogicError);
}

TEST(Parallel, SetThreadCount_IsReturned) {
  set_thread_count(1);
  EXPECT_EQ(thread_count(), 1);
  set_thread_count(0);
  EXPECT_GE(thread_count(), 1);
}

// Known answers of Philox4x32-10: Random123's kat_vectors.
TEST(LoopCheck, CheckThrows_EndsLoopsOfItsThreadAndNoOther) {
  struct Stop {};
  int asked = 0;
  const std::function<void()> check = [&] {
    if (++asked > 3) {
      throw Stop{};
    }
  };
  std::atomic<int> done{0};
  const auto loop = [&] { parallel_for(1000, 1, [&](Index, Index) { ++done; }); };
  {
    const LoopCheck checked(check);
    EXPECT_THROW(
        while (true) { loop(); }, Stop);
    const int before = asked;
    std::thread(loop).join();
    EXPECT_EQ(asked, before);
  }
  const int before = asked;
  EXPECT_NO_THROW(loop());
  EXPECT_EQ(asked, before);
}

TEST(Random, Philox_MatchesPublishedKnownAnswers) {
  const RandomWords zero = random_words(0, 0, 0);
  EXPECT_EQ(zero.word[0], 0x6627e8d5U);
  EXPECT_EQ(zero.word[1], 0xe169c58dU);
  EXPECT_EQ(zero.word[2], 0xbc57ac4cU);
  EXPECT_EQ(zero.word[3], 0x9b00dbd8U);
  const RandomWords ones = random_words(~0ULL, ~0ULL, ~0ULL);
  EXPECT_EQ(ones.word[0], 0x408f276dU);
  EXPECT_EQ(ones.word[1], 0x41c83b0eU);
  EXPECT_EQ(ones.word[2], 0xa20bc7c6U);
  EXPECT_EQ(ones.word[3], 0x6d5451fdU);
}

TEST(Random, UniformAndNormal_HaveExpectedMoments) {
  Random random{.seed = 11, .stream = 2};
  double sum = 0;
  double squares = 0;
  double normal_sum = 0;
  double normal_squares = 0;
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const double u = uniform(random);
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    sum += u;
    squares += u * u;
    const double n = normal(random);
    normal_sum += n;
    normal_squares += n * n;
  }
  EXPECT_NEAR(sum / kCount, 0.5, 0.003);
  EXPECT_NEAR(squares / kCount, 1.0 / 3, 0.003);
  EXPECT_NEAR(normal_sum / kCount, 0, 0.01);
  EXPECT_NEAR(normal_squares / kCount, 1, 0.015);
}

TEST(Random, UniformIndex_IsUniformAndStreamsDiffer) {
  Random random{.seed = 5};
  std::vector<int> counts(7);
  for (int i = 0; i < 70000; ++i) {
    ++counts[uniform_index(random, 7)];
  }
  for (const int count : counts) {
    EXPECT_NEAR(count, 10000, 400);
  }
  Random a{.seed = 5, .stream = 1};
  Random b{.seed = 5, .stream = 2};
  EXPECT_NE(uniform(a), uniform(b));
  EXPECT_THROW(uniform_index(a, 0), LogicError);
}

TEST(Random, UniformRange_IsHalfOpen) {
  Random random{.seed = 9};
  for (int i = 0; i < 1000; ++i) {
    const double value = uniform(random, -2, 3);
    EXPECT_GE(value, -2);
    EXPECT_LT(value, 3);
  }
}

}  // namespace
}  // namespace atelier
