// SPDX-License-Identifier: BSD-3-Clause
// The one loop of the library that uses threads: OpenMP where it is compiled in, else serial.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>

#ifdef _OPENMP
#include <omp.h>
#endif
#if __has_include(<unistd.h>)
#include <unistd.h>
#endif

namespace filippov {

/// How a loop runs. Both functions are called by the calling thread only, never by two at once.
struct Parallel {
    int threads = 0; ///< at most so many, >= 0; 0: as many as OpenMP takes by itself
    std::function<bool()> cancelled{}; ///< asked now and then; true: begin nothing more
    std::function<void(std::size_t done, std::size_t total)> progress{}; ///< called as work is done
    std::size_t total = 0; ///< what the work counts itself, by Worker::count; 0: one an item
};

namespace detail {

#if __has_include(<unistd.h>)
/// Threads do not survive a fork, and OpenMP's pool waits for them for ever: the child of a fork
/// works alone. It cannot know who used the pool before (another library, perhaps), so any child
/// does.
inline const auto first_process = ::getpid();
inline bool forked() { return ::getpid() != first_process; }
#else
inline bool forked() { return false; }
#endif

/// How many threads a loop over n items takes.
inline int team_size(std::size_t n, int threads) {
#ifdef _OPENMP
    if (forked())
        return 1;
    const int most = threads > 0 ? threads : omp_get_max_threads();
    return static_cast<int>(std::min(n, static_cast<std::size_t>(std::max(most, 1))));
#else
    static_cast<void>(threads);
    return static_cast<int>(std::min<std::size_t>(n, 1));
#endif
}

} // namespace detail

/// What an item of work may ask and say while it runs.
class Worker {
public:
    explicit Worker(const Parallel& how, std::size_t total) : how_(how), total_(total) {}
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// True once the loop is to stop: a long item asks now and then, and ends early.
    bool stopped() {
        if (!stop_ && is_caller())
            look_around();
        return stop_;
    }
    /// So much of `Parallel::total` is done.
    void count(std::size_t done = 1) { done_ += done; }

protected:
    bool is_caller() const { return std::this_thread::get_id() == caller_; }
    void look_around() {
        if (const std::size_t done = done_; how_.progress && done != shown_)
            how_.progress(shown_ = done, total_);
        if (how_.cancelled && how_.cancelled())
            cancelled_ = stop_ = true;
    }

    const Parallel& how_;
    const std::size_t total_;
    const std::thread::id caller_ = std::this_thread::get_id();
    std::atomic<std::size_t> done_{0};
    std::atomic<bool> stop_{false};
    std::size_t shown_ = 0;  ///< the caller's
    bool cancelled_ = false; ///< the caller's
};

namespace detail {

/// The threads of one loop, which take the next item as they are free.
template <class Work> class Crew : public Worker {
public:
    Crew(std::size_t n, const Parallel& how, Work& work)
        : Worker(how, how.total > 0 ? how.total : n), n_(n), work_(work) {}

    bool run() {
        const int team = team_size(n_, how_.threads);
        if (team > 1) {
#ifdef _OPENMP
#pragma omp parallel num_threads(team)
            take_items();
#endif
        } else {
            take_items();
        }
        if (error_)
            std::rethrow_exception(error_);
        return !cancelled_;
    }

private:
    /// No exception may leave a parallel region: the first is kept, and ends the loop.
    template <class Do> void guarded(Do what) noexcept {
        try {
            what();
        } catch (...) {
            if (!failed_.exchange(true))
                error_ = std::current_exception();
            stop_ = true;
        }
    }
    void take_items() noexcept {
        const bool caller = is_caller();
        while (!stop_) {
            const std::size_t i = next_++;
            if (i >= n_)
                break;
            guarded([&] { work_(i, static_cast<Worker&>(*this)); });
            if (how_.total == 0)
                count();
            ++ended_;
            if (caller && !stop_)
                guarded([&] { look_around(); });
        }
        if (caller)
            wait_for_others();
    }
    /// The caller goes on asking and showing while the last items of others run.
    void wait_for_others() noexcept {
        while (ended_ < std::min<std::size_t>(next_, n_)) {
            std::this_thread::sleep_for(std::chrono::microseconds(200));
            if (!stop_)
                guarded([&] { look_around(); });
        }
        if (!stop_ && done_ != shown_)
            guarded([&] { look_around(); });
    }

    const std::size_t n_;
    Work& work_;
    std::atomic<std::size_t> next_{0}, ended_{0};
    std::atomic<bool> failed_{false};
    std::exception_ptr error_;
};

} // namespace detail

/// Calls work(i, worker) for i = 0 ... n-1, each once, in any order and on several threads.
///
/// @param work  what it does with i must not depend on the other items: then the number of threads
///              changes no bit of the result
/// @return      false if `cancelled` said so: some items were not begun, or ended early
/// @error       std::invalid_argument for threads < 0; the first exception of the work, or of
///              `cancelled` or `progress`, once all threads have stopped
/// @cost        serial without OpenMP, for one item, within a parallel region of OpenMP, and in a
///              process that was forked after this library was loaded
template <class Work> bool parallel_for(std::size_t n, const Parallel& how, Work&& work) {
    if (how.threads < 0)
        throw std::invalid_argument("filippov: threads = " + std::to_string(how.threads) +
                                    ": expected an integer >= 0 (0: automatic)");
    return detail::Crew<Work>(n, how, work).run();
}

} // namespace filippov
