/* Times an emitted ensemble on the first card of the machine and compares the first trajectories with references.
   `program TRAJECTORIES REPETITIONS` reads reference.bin and writes states.bin. */

#include "ensemble.cu"
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <algorithm>
#include <vector>

static void check(cudaError_t error, const char *what)
{
    if (error != cudaSuccess) {
        printf("%s: %s\n", what, cudaGetErrorString(error));
        exit(1);
    }
}

template <typename T> static T *device(size_t count, int fill)
{
    T *values;
    check(cudaMalloc(&values, count * sizeof(T)), "allocation");
    check(cudaMemset(values, fill, count * sizeof(T)), "poison");
    return values;
}

int main(int words, char **word)
{
    const long long count = words > 1 ? atoll(word[1]) : 1000000;
    const int repetitions = words > 2 ? atoi(word[2]) : 3;
    FILE *file = fopen("reference.bin", "rb");
    double head[7];
    if (!file || fread(head, 8, 7, file) != 7) {
        printf("reference.bin is missing\n");
        return 1;
    }
    /* References: number, then begin, end, tolerance, scalars, ranges, starts, and two sets of final states. */
    const long long known = (long long)head[0];
    std::vector<double> s(FL_SCALARS), ranges(2 * FL_N), starts(FL_N * known), own(FL_N * known), exact(FL_N * known);
    std::vector<double> steps(known);
    size_t got = fread(s.data(), 8, s.size(), file) + fread(ranges.data(), 8, ranges.size(), file);
    got += fread(starts.data(), 8, starts.size(), file) + fread(own.data(), 8, own.size(), file);
    got += fread(exact.data(), 8, exact.size(), file) + fread(steps.data(), 8, steps.size(), file);
    fclose(file);
    if (got != s.size() + ranges.size() + 3 * starts.size() + steps.size()) {
        printf("reference.bin is too short\n");
        return 1;
    }
    fl_job job = {};
    job.count = count;
    job.begin = head[1];
    job.end = head[2];
    job.sign = 1.0;
    job.longest = 1e100;
    job.limit = 4e9;
    job.relative = head[3];
    job.size = 1.0;
    for (int i = 0; i < FL_N; i++) {
        job.absolute[i] = head[3];
    }
    std::copy(s.begin(), s.end(), job.s);
    std::vector<double> all(FL_N * count);
    for (long long c = 0; c < count; c++) {
        for (int i = 0; i < FL_N; i++) {
            const double place = 0.5 + (double)(c + 1) * sqrt((double)i + 2.0);
            const double low = ranges[2 * i], high = ranges[2 * i + 1];
            all[i * count + c] = c < known ? starts[i * known + c] : low + (place - floor(place)) * (high - low);
        }
    }
    double *from = device<double>(FL_N * count, 0);
    check(cudaMemcpy(from, all.data(), all.size() * 8, cudaMemcpyHostToDevice), "copy");
    job.starts = from;
    job.states = device<double>(FL_N * count, 255);
    job.times = device<double>(count, 255);
    job.outcomes = device<int>(count, 255);
    job.steps = device<unsigned>(count, 255);
    job.rejected = device<unsigned>(count, 255);
    job.next = device<unsigned long long>(1, 0);
    check(cudaMemcpyToSymbol(fl_the_job, &job, sizeof job), "job");

    cudaDeviceProp card;
    check(cudaGetDeviceProperties(&card, 0), "card");
    int per = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&per, fl_kernel, FL_THREADS, 0), "occupancy");
    cudaFuncAttributes used;
    check(cudaFuncGetAttributes(&used, fl_kernel), "attributes");
    const long long needed = (count + FL_THREADS - 1) / FL_THREADS;
    const int blocks = (int)std::min<long long>((long long)card.multiProcessorCount * per, needed);
    cudaEvent_t begin, end;
    cudaEventCreate(&begin);
    cudaEventCreate(&end);
    std::vector<float> times;
    for (int k = 0; k < repetitions + 1; k++) {
        check(cudaMemset(job.next, 0, 8), "counter");
        check(cudaDeviceSynchronize(), "before");
        cudaEventRecord(begin);
        fl_kernel<<<blocks, FL_THREADS>>>();
        cudaEventRecord(end);
        check(cudaGetLastError(), "launch");
        check(cudaDeviceSynchronize(), "kernel");
        float time;
        cudaEventElapsedTime(&time, begin, end);
        if (k > 0 || repetitions == 0) {
            times.push_back(time);
        }
    }
    std::sort(times.begin(), times.end());
    std::vector<double> states(FL_N * count);
    std::vector<unsigned> accepted(count), rejected(count);
    std::vector<int> outcomes(count);
    check(cudaMemcpy(states.data(), job.states, states.size() * 8, cudaMemcpyDeviceToHost), "states");
    check(cudaMemcpy(accepted.data(), job.steps, count * 4, cudaMemcpyDeviceToHost), "steps");
    check(cudaMemcpy(rejected.data(), job.rejected, count * 4, cudaMemcpyDeviceToHost), "steps");
    check(cudaMemcpy(outcomes.data(), job.outcomes, count * 4, cudaMemcpyDeviceToHost), "outcomes");
    unsigned long long total = 0, refused = 0, unfinished = 0;
    for (long long c = 0; c < count; c++) {
        total += (unsigned long long)accepted[c] + rejected[c];
        refused += rejected[c];
        unfinished += outcomes[c] != FL_REACHED;
    }
    const double time = 1e-3 * times[times.size() / 2];
    printf("%-22s %3d threads, %2d blocks per multiprocessor, %3d registers, %3zu bytes local: %.4f s (best %.4f), "
           "%.3e steps (%.1f%% rejected), %.3e steps/s\n",
           words > 3 ? word[3] : "", FL_THREADS, per, used.numRegs, used.localSizeBytes, time, 1e-3 * times[0],
           (double)total, 100.0 * refused / total, total / time);
    /* Differences of the first trajectories: largest component relative to 1 + |x|. */
    std::vector<double> to_own, to_exact, own_to_exact;
    long long same_steps = 0, same_bits = 0;
    for (long long c = 0; c < std::min(known, count); c++) {
        double worst[3] = {0.0, 0.0, 0.0};
        bool bits = true;
        for (int i = 0; i < FL_N; i++) {
            const double x = states[i * count + c], a = own[i * known + c], b = exact[i * known + c];
            const double apart[3] = {fabs(x - a), fabs(x - b), fabs(a - b)};
            for (int k = 0; k < 3; k++) {
                worst[k] = apart[k] <= worst[k] * (1.0 + fabs(b)) ? worst[k] : apart[k] / (1.0 + fabs(b));
            }
            bits = bits && x == a;
        }
        to_own.push_back(worst[0]);
        to_exact.push_back(worst[1]);
        own_to_exact.push_back(worst[2]);
        same_bits += bits;
        same_steps += steps[c] == (double)accepted[c] + rejected[c];
    }
    for (std::vector<double> *list : {&to_own, &to_exact, &own_to_exact}) {
        std::sort(list->begin(), list->end());
    }
    const size_t half = to_own.size() / 2, most = to_own.size() - 1, nine = to_own.size() * 9 / 10;
    printf("%-22s t = %g: median, 90%%, largest difference to the processor %.1e %.1e %.1e, to tolerance 1e-12 %.1e "
           "%.1e %.1e (of the processor %.1e %.1e %.1e); as many steps %lld, equal bits %lld of %zu; %llu not at the "
           "end\n",
           words > 3 ? word[3] : "", job.end, to_own[half], to_own[nine], to_own[most], to_exact[half], to_exact[nine],
           to_exact[most], own_to_exact[half], own_to_exact[nine], own_to_exact[most], same_steps, same_bits,
           to_own.size(), unfinished);
    file = fopen("states.bin", "wb");
    for (int i = 0; i < FL_N; i++) {
        fwrite(&states[i * count], 8, std::min(known, count), file);
    }
    fclose(file);
    return 0;
}
