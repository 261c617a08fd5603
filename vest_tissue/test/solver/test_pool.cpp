// Protects the pool of threads: each item of each round is worked on once, whoever sleeps, and no round
// begins before the last one is over. Each thread works on its own share, and on a busy one's.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

#include "vest_tissue/solver/pool.h"

namespace vest::solver {
namespace {

TEST(Pool, EachItemOfEachRoundIsWorkedOnOnce) {
  for (const int threads : {1, 2, 3, 8}) {
    Pool pool(threads);
    EXPECT_EQ(threads, pool.threads());
    std::vector<int> hits(64);
    std::size_t wrong = 0;
    for (std::size_t round = 0; round < 20000; ++round) {
      const std::size_t count = (7 * round) % 41;
      std::fill(hits.begin(), hits.end(), 0);
      auto work = [&](std::size_t item) { ++hits[item]; };
      pool.each(count, work);
      for (std::size_t item = 0; item < hits.size(); ++item) wrong += hits[item] != (item < count ? 1 : 0);
      // Now and then long enough that all workers go to sleep.
      if (round % 2000 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    EXPECT_EQ(0u, wrong) << threads << " threads";
  }
}

TEST(Pool, ALongItemIsWaitedFor) {
  Pool pool(2);
  for (int round = 0; round < 20; ++round) {
    std::vector<int> done(2);
    auto work = [&](std::size_t item) {
      std::this_thread::sleep_for(std::chrono::milliseconds(item == 0 ? 1 : 3));
      done[item] = 1;
    };
    pool.each(2, work);
    EXPECT_EQ(2, done[0] + done[1]);
  }
}

TEST(Pool, EachThreadWorksOnItsOwnShareInEachRound) {
  Pool pool(2);
  const std::vector<std::size_t> ends{1, 2};
  std::array<std::thread::id, 2> first, now;
  for (int round = 0; round < 200; ++round) {
    std::array<std::atomic<bool>, 2> begun{};
    auto work = [&](std::size_t item) {
      now[item] = std::this_thread::get_id();
      begun[item] = true;
      while (!begun[1 - item]) std::this_thread::yield();  // so that no thread does both
    };
    pool.each(ends, work);
    if (round == 0) first = now;
    EXPECT_EQ(std::this_thread::get_id(), now[0]);
    ASSERT_EQ(first[1], now[1]);
  }
}

TEST(Pool, WhatABusyThreadHasLeftIsTakenFromTheEndOfItsShare) {
  Pool pool(2);
  const std::vector<std::size_t> ends{1, 3};
  for (int round = 0; round < 200; ++round) {
    std::array<std::atomic<bool>, 3> done{};
    auto work = [&](std::size_t item) {
      while (item == 1 && !done[2]) std::this_thread::yield();  // it blocks the thread whose share both are
      done[item] = true;
    };
    pool.each(ends, work);
    ASSERT_TRUE(done[0] && done[1] && done[2]);
  }
}

TEST(Pool, MoreItemsThanARoundHoldsAreWorkedOnByTheCaller) {
  Pool pool(2);
  std::vector<std::uint8_t> hits(300000);
  auto work = [&](std::size_t item) { ++hits[item]; };
  pool.each(hits.size(), work);
  for (const auto hit : hits) ASSERT_EQ(1, hit);
}

}  // namespace
}  // namespace vest::solver
