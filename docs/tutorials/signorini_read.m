% r = signorini_read (file): everything in a file of signorini as a struct, r.trajectory.t, r.mesh.nodes, r.backbone.omega, ...
% MATLAB and Octave count the last dimension of HDF5 first: r.trajectory.u is displacement x state.
% Numbers in r.mesh.dof_map and r.mesh.contact_nodes count from 0 (-1: held): add 1.
function r = signorini_read (file)
  if exist ('OCTAVE_VERSION', 'builtin')
    r = load ('-hdf5', file);
  else
    r = group (h5info (file), file);
  end
end

function s = group (info, file)
  s = struct ();
  for d = reshape (info.Datasets, 1, [])
    s.(d.Name) = h5read (file, [info.Name '/' d.Name]);
  end
  for g = reshape (info.Groups, 1, [])
    [~, name] = fileparts (g.Name);
    s.(matlab.lang.makeValidName (name)) = group (g, file);
  end
end
