"""Values: images, labels, studies, options, progress and results, each valid once it exists."""
