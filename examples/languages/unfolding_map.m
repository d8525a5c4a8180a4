function unfolding_map(service, picture)
% An unfolding map and the grazing curve over it, in MATLAB or Octave: unfolding_map('http://127.0.0.1:8000', 'map.png')
    omega = struct('start', 0.26, 'stop', 0.30, 'points', 24);
    clearance = struct('start', 1.3, 'stop', 2.1, 'points', 16);
    curve = compute(service, 'grazing-curves', struct('omega', omega));
    map = compute(service, 'unfolding-maps', struct('omega', omega, 'clearance', clearance));

    window = figure('Visible', 'off');
    imagesc(map.omega, map.clearance, map.motion);  % places in map.motions, counted from 0
    colormap(lines(numel(map.motions)));
    axis xy
    hold on
    plot(curve.omega, curve.clearance, 'k', 'LineWidth', 2);
    xlabel('omega');
    ylabel('clearance');
    print(window, picture, '-dpng');
    fprintf('%d motions; the curve ends at clearance %.15g\n', numel(map.motions), curve.clearance(end));
end

function result = compute(service, process, request)
% Submits a request, waits until its job has ended, and returns the result, with NaN for null.
    job = post([service '/v1/' process], jsonencode(request));
    address = [service '/v1/jobs/' job.id];
    while any(strcmp(job.status, {'accepted', 'running'}))
        pause(1);
        job = read(address);
    end
    if ~strcmp(job.status, 'successful')
        error(job.problem.detail);
    end
    result = read([address '/result']);
end

function answer = read(address)
    answer = webread(address, weboptions('ContentType', 'json', 'Timeout', 60));
    if ischar(answer)  % as Octave returns it
        answer = jsondecode(answer);
    end
end

function answer = post(address, text)
    if ~exist('OCTAVE_VERSION', 'builtin')
        options = weboptions('MediaType', 'application/json', 'ContentType', 'json', 'Timeout', 60, ...
                             'HeaderFields', {'Prefer', 'wait=30'});
        answer = webwrite(address, text, options);
        return
    end
    % webwrite of Octave sends forms, and no JSON
    file = tempname();
    fid = fopen(file, 'w');
    fputs(fid, text);
    fclose(fid);
    curl = 'curl --silent --header "Content-Type: application/json" --header "Prefer: wait=30" --data @';
    [~, answer] = system([curl file ' ' address]);
    delete(file);
    answer = jsondecode(answer);
end
