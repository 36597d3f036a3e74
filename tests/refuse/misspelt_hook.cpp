// expect: evnt
#include <filippov/run/observers.hpp>

int main() {
    const filippov::Observer<double, 2, 1> observer{.evnt = [](const auto&) {}};
    return observer.event ? 1 : 0;
}
