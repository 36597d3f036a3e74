// SPDX-License-Identifier: BSD-3-Clause
// The one parallel loop: every item once, exceptions once, the caller's functions on the caller's
// thread, and no hang in the child of a fork.

#include "catch.hpp"

#include <filippov/core/parallel.hpp>

#include <numeric>
#include <set>
#include <vector>

#if __has_include(<sys/wait.h>)
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#endif

using namespace filippov;

namespace {

void rest(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

#ifdef _OPENMP
constexpr bool has_threads = true;
#else
constexpr bool has_threads = false;
#endif

} // namespace

TEST_CASE("parallel_for: does every item once, for any number of threads", "[parallel]") {
    const int threads = GENERATE(0, 1, 2, 7);
    const std::size_t n = GENERATE(0, 1, 2, 1000);
    std::vector<int> times(n, 0);
    CHECK(parallel_for(n, {.threads = threads}, [&](std::size_t i, Worker&) { ++times[i]; }));
    CHECK(times == std::vector<int>(n, 1));
}

TEST_CASE("parallel_for: takes as many threads as it is told", "[parallel]") {
    const int threads = GENERATE(1, 3);
    std::vector<std::thread::id> who(12);
    parallel_for(who.size(), {.threads = threads}, [&](std::size_t i, Worker&) {
        who[i] = std::this_thread::get_id();
        rest(5); // long enough for the others to take theirs
    });
    const std::set<std::thread::id> seen(who.begin(), who.end());
    CHECK(seen.size() == static_cast<std::size_t>(has_threads ? threads : 1));
}

TEST_CASE("parallel_for: rethrows one exception, once, and begins nothing after it", "[parallel]") {
    const int threads = GENERATE(1, 2, 4);
    std::atomic<int> begun{0};
    const auto work = [&](std::size_t, Worker&) {
        ++begun;
        throw std::runtime_error("from an item");
    };
    CHECK_THROWS_WITH(parallel_for(1000, {.threads = threads}, work), "from an item");
    CHECK(begun >= 1);
    CHECK(begun <= threads);
}

TEST_CASE("parallel_for: calls cancelled and progress from the calling thread only", "[parallel]") {
    const auto caller = std::this_thread::get_id();
    bool elsewhere = false;
    std::vector<std::size_t> shown;
    Parallel how{.threads = 3};
    how.cancelled = [&] {
        elsewhere = elsewhere || std::this_thread::get_id() != caller;
        return false;
    };
    how.progress = [&](std::size_t done, std::size_t total) {
        elsewhere = elsewhere || std::this_thread::get_id() != caller;
        CHECK(total == 20);
        shown.push_back(done);
    };
    CHECK(parallel_for(20, how, [](std::size_t, Worker& worker) {
        rest(1);
        static_cast<void>(worker.stopped());
    }));
    CHECK_FALSE(elsewhere);
    CHECK(std::is_sorted(shown.begin(), shown.end()));
    CHECK(std::adjacent_find(shown.begin(), shown.end()) == shown.end());
    REQUIRE(!shown.empty());
    CHECK(shown.back() == 20);
}

TEST_CASE("parallel_for: an exception of progress ends the loop and comes out", "[parallel]") {
    Parallel how{.threads = GENERATE(1, 3)};
    how.progress = [](std::size_t, std::size_t) { throw std::runtime_error("from progress"); };
    std::atomic<int> done{0};
    CHECK_THROWS_WITH(parallel_for(1000, how,
                                   [&](std::size_t, Worker&) {
                                       rest(1);
                                       ++done;
                                   }),
                      "from progress");
    CHECK(done < 1000);
}

TEST_CASE("parallel_for: cancelling reaches items that are under way", "[parallel]") {
    // one item for each thread, endless unless stopped; the caller may be in one, or be waiting
    const int threads = GENERATE(1, 2, 4);
    const auto begun = std::chrono::steady_clock::now();
    Parallel how{.threads = threads};
    how.cancelled = [&] {
        return std::chrono::steady_clock::now() - begun > std::chrono::milliseconds(50);
    };
    std::atomic<int> stopped{0};
    const bool all =
        parallel_for(static_cast<std::size_t>(threads), how, [&](std::size_t i, Worker& worker) {
            if (i == 0 && threads > 1)
                return; // who had this one waits for the rest
            for (int k = 0; k < 10'000 && !worker.stopped(); ++k)
                rest(1);
            ++stopped;
        });
    CHECK_FALSE(all);
    CHECK(stopped >= (has_threads && threads > 1 ? threads - 1 : 1));
    CHECK(std::chrono::steady_clock::now() - begun < std::chrono::seconds(5));
}

TEST_CASE("parallel_for: counts what the work counts", "[parallel]") {
    std::size_t last = 0;
    Parallel how{.threads = 2};
    how.total = 30;
    how.progress = [&](std::size_t done, std::size_t total) {
        CHECK(total == 30);
        last = done;
    };
    parallel_for(3, how, [](std::size_t, Worker& worker) {
        for (int k = 0; k < 10; ++k)
            worker.count();
    });
    CHECK(last == 30);
}

TEST_CASE("parallel_for: works within another one", "[parallel]") {
    std::atomic<int> sum{0};
    parallel_for(4, {.threads = 2}, [&](std::size_t, Worker&) {
        parallel_for(10, {.threads = 2}, [&](std::size_t, Worker&) { ++sum; });
    });
    CHECK(sum == 40);
}

TEST_CASE("parallel_for: refuses a negative number of threads", "[parallel]") {
    CHECK_THROWS_WITH(parallel_for(1, {.threads = -2}, [](std::size_t, Worker&) {}),
                      "filippov: threads = -2: expected an integer >= 0 (0: automatic)");
}

#if __has_include(<sys/wait.h>)
TEST_CASE("parallel_for: does not hang in the child of a fork", "[parallel]") {
    const auto sum = [] {
        std::atomic<int> total{0};
        parallel_for(100, {.threads = 2},
                     [&](std::size_t i, Worker&) { total += static_cast<int>(i); });
        return static_cast<int>(total);
    };
    REQUIRE(sum() == 4950); // now the pool of threads is there
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0)
        ::_exit(sum() == 4950 ? 0 : 1);
    int status = -1;
    pid_t ended = 0;
    for (int k = 0; k < 5000 && ended == 0; ++k) {
        ended = ::waitpid(child, &status, WNOHANG);
        if (ended == 0)
            rest(1);
    }
    if (ended == 0)
        ::kill(child, SIGKILL);
    CHECK(ended == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    CHECK(sum() == 4950); // and the parent goes on
}
#endif
